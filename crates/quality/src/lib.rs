//! How well do these contacts hold?
