"""Pictures of what the workers see: scenes, keypoints and lifted skeletons."""
