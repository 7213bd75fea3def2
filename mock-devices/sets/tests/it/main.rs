//! The catalogue of hidden physics, held against the base model.

mod catalogue;
