"""The files of a training on disk, from which a killed training resumes with the same result."""
