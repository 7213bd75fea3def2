//! Reference mechanics of an elastic covering.
