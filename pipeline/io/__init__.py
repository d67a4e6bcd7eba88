"""Reading and writing of images, intrinsics, poses, clouds, meshes and rigs, with no partly written file."""
