"""The language that all of Vantage's processes speak: messages, the types in them, and how they travel."""
