"""echobeam: sensing-assisted predictive beamforming."""
