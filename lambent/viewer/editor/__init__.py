"""The material editor without its window: the measurement, what it says of a material, the fit, the documents."""
