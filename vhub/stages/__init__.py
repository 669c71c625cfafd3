"""The stages that every packet passes in the virtual hub, one file each."""
