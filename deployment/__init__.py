"""The deployment file: its schema, how it is read and checked, overrides, hosts, assets."""
