"""Pictures of the world, made with numpy alone."""
