//! Compares the catalogue of hidden physics with the base model.

mod catalogue;
