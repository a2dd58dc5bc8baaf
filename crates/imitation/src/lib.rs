//! Which object and grasp best match a demonstration?
