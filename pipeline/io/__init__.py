"""Reading and writing of images, intrinsics, poses, clouds, meshes and rigs; no file is written in part."""
