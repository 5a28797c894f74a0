"""The commands, one file each; ``main`` finds them and maps errors to exit statuses."""
