use super::*;

fn one(tau_s: f64) -> Lags {
    Lags::new([(tau_s, 1.0)])
}

/// Output after a straight input from 0 at 0 s with a slope of 2, in this many equal steps to 3 s.
fn ramp(steps: u32, tau_s: f64) -> Lags {
    let mut lag = one(tau_s);
    lag.begin(&[0.0], &[0.0]);
    for k in 1..=steps {
        lag.follow(3.0 / f64::from(steps), &[6.0 * f64::from(k) / f64::from(steps)]);
    }
    lag
}

#[test]
fn a_ramp_gives_its_closed_form_in_any_number_of_steps() {
    let tau_s = 0.7_f64;
    let want = 2.0 * (3.0 - tau_s * (1.0 - (-3.0 / tau_s).exp()));
    for steps in [1, 2, 90, 3000] {
        let lag = ramp(steps, tau_s);
        assert!((lag.output()[0] - want).abs() < 1e-12, "{steps} steps: {}", lag.output()[0]);
    }
}

#[test]
fn a_step_is_approached_exponentially() {
    let mut lag = one(2.0);
    lag.begin(&[1.0], &[1.0]);
    lag.follow(0.0, &[5.0]);
    assert_eq!(lag.output(), [1.0], "a jump takes no time");
    lag.follow(1.5, &[5.0]);
    assert!((lag.output()[0] - (5.0 - 4.0 * (-0.75_f64).exp())).abs() < 1e-14);
}

#[test]
fn no_lag_follows_at_once_and_a_small_one_nearly() {
    assert_eq!(ramp(10, 0.0).output(), [6.0]);
    assert!((ramp(10, 1e-9).output()[0] - 6.0).abs() < 1e-8);
    assert!((ramp(10, 1e9).output()[0] - 9.0e-9).abs() < 1e-14, "a slow one has seen the input's integral");
}

#[test]
fn several_lags_add_up_by_their_weights() {
    let parts = [(0.3, 0.5), (0.0, -2.0), (4.0, 0.25)];
    let mut together = Lags::new(parts);
    let mut apart = parts.map(|(tau_s, _)| one(tau_s));
    together.begin(&[1.0, 3.0], &[1.0, 0.0]);
    for lag in &mut apart {
        lag.begin(&[1.0, 3.0], &[1.0, 0.0]);
    }
    for input in [[1.0, 3.0], [2.0, -1.0], [0.5, 7.0]] {
        for element in 0..2 {
            let want: f64 =
                parts.iter().zip(&apart).map(|((_, weight), lag)| weight * lag.output()[element]).sum();
            assert!((together.output()[element] - want).abs() < 1e-14);
        }
        together.follow(0.2, &input);
        for lag in &mut apart {
            lag.follow(0.2, &input);
        }
    }
    together.reset();
    assert!(!together.has_begun());
}
