use super::*;

/// A draft that adds the same counts to each element, with a weight for so many.
fn weighted(elements: usize) -> Held {
    let weights = vec!["1.0"; elements].join(", ");
    let text = format!(
        "schema = 'tactus.draft/1'\nstatus = 'drafted'\n[effect]\nname = 'grounding'\nsentence = 'It rises.'\nstage = 'readout'\n\
         carrier = 'counts'\ncombine = 'add'\nwhen = 'in contact'\nlaw = 'linear'\nnumbers = {{ offset = 3.0, slope = 0.0 }}\n\
         weights = [{weights}]\n[[effect.covariate]]\nname = 'depth'\nunit = 'mm'\nrange = [0.0, 0.6]\n"
    );
    Held { path: "own/grounding.toml".into(), draft: DraftFile::from_toml(&text).unwrap() }
}

#[test]
fn a_draft_of_another_array_is_told_with_its_file() {
    let array = Array::digitacts();
    assert_eq!(weighted(48).of_another_array(&array), None);
    let told = weighted(47).of_another_array(&array).unwrap();
    assert_eq!(
        told,
        "own/grounding.toml: draft \"grounding\": it has weights for 47 elements, and the array has 48; it is of another array, and was not \
         tried"
    );
}
