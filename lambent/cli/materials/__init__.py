"""Commands on materials: measured tables and documents."""
