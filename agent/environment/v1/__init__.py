"""`vantage/Hover-v1`: fly to where a person's joints are known to centimetres."""
