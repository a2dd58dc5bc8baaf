//! Which tasks would a person say that this grasp affords?
