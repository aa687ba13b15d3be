"""Identification while sailing: from decoded tables to parameters, prediction errors and warnings."""
