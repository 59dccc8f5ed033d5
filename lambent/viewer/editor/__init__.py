"""The material editor without its window: the material, its measurement, the plots of both, the fit, the files."""
