"""Numbers of a model from measured data: records, noise, prediction, fit, intervals."""
