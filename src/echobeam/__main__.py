"""`python -m echobeam`: the command line."""

from echobeam.cli.main import main

if __name__ == "__main__":
    main()
