"""Functions behind the commands: one for each, of the same name and arguments.

`asking` reads what a user gives and tells all that is wrong at once; `run`, `sweep` and
`reproduce` write files; `simulate` and `summary` have none. The command line adds options, tables
and exit statuses, and nothing else.
"""
