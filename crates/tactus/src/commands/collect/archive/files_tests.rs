use super::*;

#[test]
fn files_of_one_second_sort_in_the_order_of_time() {
    let names: Vec<_> = file_names("20260131-142530-left").take(9).map(|id| format!("{id}.mcap")).collect();
    assert_eq!(names[0], "20260131-142530-left.mcap");
    assert!(names.is_sorted(), "{names:?}");
    assert!(names[8].as_str() < "20260131-142531-left.mcap", "{names:?}");
}
