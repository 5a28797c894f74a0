"""The commands, one file each; ``main`` finds them and maps errors to exit statuses.

What lives here: options, progress, printing. What may come in: every room, imported inside the functions so that
``--help`` needs none of them; nothing imports a command.
"""
