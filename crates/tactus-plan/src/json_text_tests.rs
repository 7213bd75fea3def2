use serde_json::json;

use super::*;

#[derive(Serialize, Deserialize)]
struct Held(#[serde(with = "super")] Value);

fn through_text(value: &Value) -> Value {
    let text = serde_json::to_string(&Held(value.clone())).unwrap();
    serde_json::from_str::<Held>(&text).unwrap().0
}

#[test]
fn values_come_through() {
    for value in
        [json!(true), json!(-3), json!(i64::MAX), json!("text"), json!(null), json!({ "a": [1, [2.5]] })]
    {
        assert_eq!(through_text(&value), value);
    }
}

#[test]
fn numbers_keep_every_bit() {
    // Without serde_json's `arbitrary_precision`, which the evaluator switches on, some would be one bit off.
    let mut bits = 0x3fe0_4189_374b_c6a8_u64;
    for _ in 0..1000 {
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407) >> 2;
        let number = f64::from_bits(bits);
        assert_eq!(through_text(&json!([number]))[0].as_f64().map(f64::to_bits), Some(bits), "{number}");
    }
}
