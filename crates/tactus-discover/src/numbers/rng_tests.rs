use super::Rng;

#[test]
fn a_seed_gives_the_same_numbers_everywhere() {
    let mut rng = Rng::new(1);
    // By an independent program: ChaCha of eight rounds, its key from the seed by PCG32.
    let want = [0x6709_4cea_8ca4_0db1, 0x1494_06d8_fc0e_8e6b, 0x98b8_2b03_3607_0665];
    assert_eq!([rng.bits(), rng.bits(), rng.bits()], want);
    let mut items: Vec<usize> = (0..8).collect();
    rng.shuffle(&mut items);
    assert_eq!(items, [5, 3, 0, 6, 1, 4, 7, 2]);
}

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
fn every_item_reaches_every_place_equally_often() {
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
