use super::*;

const LINES: &str = "\
{\"stage\":\"base\",\"what\":\"recalibrating\",\"elapsed_s\":0.0}
{\"stage\":\"drafting\",\"what\":\"drafting\",\"elapsed_s\":4.0}
{\"stage\":\"end\",\"what\":\"\",\"elapsed_s\":16.0}
";

#[test]
fn moments_are_evenly_in_time() {
    let moments = of_lines(3, LINES).unwrap_or_default();
    assert_eq!(moments.len(), MOMENTS);
    assert_eq!(moments.iter().filter(|moment| moment.stage == "base").count(), MOMENTS / 4);
    assert!(moments.iter().all(|moment| (moment.elapsed_s + moment.left_s - 16.0).abs() < 1e-9));
    assert!(moments.iter().all(|moment| moment.stage != "end" && moment.set == 3));
}

#[test]
fn the_table_has_the_quantiles_of_the_time_left_over_the_time_so_far() {
    let moment =
        |tenths: u32| Moment { set: 0, stage: "drafting".into(), elapsed_s: 10.0, left_s: f64::from(tenths) };
    let moments: Vec<Moment> = (0..=100).map(moment).collect();
    let table = progress_table(&moments);
    assert!(table.starts_with("    (\"drafting\", [1.00, 5.00, 9.00]),\n"), "{table}");
}
