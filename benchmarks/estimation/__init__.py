"""What estimation comes to: keypoints, quality and the filter, against the truth of rendered scenes."""
