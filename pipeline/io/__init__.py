"""Files: images, intrinsics, poses, clouds, meshes and rigs, checked when read and whole when written."""
