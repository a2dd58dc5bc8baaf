//! Which grasps has this hand on this object, and what are their features?
