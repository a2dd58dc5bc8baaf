//! What follows from evidence in a mixed Bayesian network?
