"""Functions of the commands: one for each, with the same name and arguments.

`asking` validates the input and reports all its errors together; `run`, `sweep` and `reproduce`
write files; `simulate` and `summary` work in memory. The command line adds only options, tables
and exit statuses.
"""
