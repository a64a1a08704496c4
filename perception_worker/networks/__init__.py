"""The pose networks: their files, the engines that run them, and keypoints from heatmaps."""
