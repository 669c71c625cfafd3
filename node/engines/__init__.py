"""Physics engines: one light file each, which registers it (`world.forms.registry`) and imports it when it is made."""
