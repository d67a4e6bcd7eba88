"""Reading and writing of images, intrinsics, poses, clouds, meshes and rigs; no file remains half written."""
