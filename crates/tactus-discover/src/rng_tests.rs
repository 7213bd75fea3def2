use super::Rng;

#[test]
fn every_number_below_the_end_is_equally_likely() {
    let mut rng = Rng::new(2);
    let mut counts = [0_u32; 7];
    for _ in 0..70_000 {
        counts[rng.below(7)] += 1;
    }
    // 5 standard deviations of a binomial count.
    assert!(counts.iter().all(|count| count.abs_diff(10_000) < 463), "{counts:?}");
    assert_eq!([rng.below(1), rng.below(0)], [0, 0]);
}

#[test]
fn every_item_comes_to_every_place_equally_often() {
    let mut rng = Rng::new(3);
    let mut counts = [[0_u32; 4]; 4];
    for _ in 0..40_000 {
        let mut items = [0, 1, 2, 3];
        rng.shuffle(&mut items);
        items.iter().enumerate().for_each(|(place, item)| counts[place][*item] += 1);
    }
    // 5 standard deviations of a binomial count.
    assert!(counts.iter().flatten().all(|count| count.abs_diff(10_000) < 434), "{counts:?}");
}
