"""What a node sends of its images, in what form, and what is left of them at the sink (SPEC 6.5)."""
