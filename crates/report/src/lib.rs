//! How do results become figures and one page?
