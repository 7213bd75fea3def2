use super::*;

/// Norris, of the Statistical Reference Datasets of NIST: a line with certified parameters and standard errors.
/// <https://www.itl.nist.gov/div898/strd/lls/data/Norris.shtml>
const NORRIS: [[f64; 2]; 36] = [
    [0.2, 0.1],
    [337.4, 338.8],
    [118.2, 118.1],
    [884.6, 888.0],
    [10.1, 9.2],
    [226.5, 228.1],
    [666.3, 668.5],
    [996.3, 998.5],
    [448.6, 449.1],
    [777.0, 778.9],
    [558.2, 559.2],
    [0.4, 0.3],
    [0.6, 0.1],
    [775.5, 778.1],
    [666.9, 668.8],
    [338.0, 339.3],
    [447.5, 448.9],
    [11.6, 10.8],
    [556.0, 557.7],
    [228.1, 228.3],
    [995.8, 998.0],
    [887.6, 888.8],
    [120.2, 119.6],
    [0.3, 0.3],
    [0.3, 0.6],
    [556.8, 557.6],
    [339.1, 339.3],
    [887.2, 888.0],
    [999.0, 998.5],
    [779.0, 778.9],
    [11.1, 10.2],
    [118.3, 117.6],
    [229.2, 228.9],
    [669.1, 668.4],
    [448.9, 449.2],
    [0.5, 0.2],
];

fn line(parameters: &[f64]) -> Normal {
    let mut normal = Normal::new(2);
    for [x, y] in NORRIS {
        normal.add(y - parameters[0] - parameters[1] * x, &[(0, 1.0), (1, x)], 1.0);
    }
    normal
}

#[test]
fn a_line_through_certified_data_has_the_certified_parameters_and_errors() {
    let fit = minimise(vec![0.0, 0.0], &[true, true], |at| Some(line(at))).unwrap();
    let close = |got: f64, certified: f64| assert!((got / certified - 1.0).abs() < 1e-7, "{got} {certified}");
    close(fit.parameters[0], -0.262_323_073_774_029);
    close(fit.parameters[1], 1.002_116_818_020_45);
    close((fit.covariance[(0, 0)] * fit.misfit).sqrt(), 0.232_818_234_301_152);
    close((fit.covariance[(1, 1)] * fit.misfit).sqrt(), 0.429_796_848_199_937e-3);
}

#[test]
fn a_parameter_that_is_not_free_stays() {
    let fit = minimise(vec![1.0, 0.0], &[false, true], |at| Some(line(at))).unwrap();
    assert!((fit.parameters[0] - 1.0).abs() < 1e-15);
    assert!(fit.covariance[(0, 0)].abs() < 1e-15 && fit.covariance[(0, 1)].abs() < 1e-15);
}

/// Misra1a, of the same datasets: `y = b1 (1 - exp(-b2 x))`, from its farther start.
/// <https://www.itl.nist.gov/div898/strd/nls/data/misra1a.shtml>
#[test]
fn a_curve_through_certified_data_is_found_from_afar() {
    let data = [
        [77.6, 10.07],
        [114.9, 14.73],
        [141.1, 17.94],
        [190.8, 23.93],
        [239.9, 29.61],
        [289.0, 35.18],
        [332.8, 40.02],
        [378.4, 44.82],
        [434.8, 50.76],
        [477.3, 55.05],
        [536.8, 61.01],
        [593.1, 66.40],
        [689.1, 75.47],
        [760.0, 81.78],
    ];
    let curve = |b: &[f64]| {
        let mut normal = Normal::new(2);
        for [x, y] in data {
            let rest = (-b[1] * x).exp();
            normal.add(y - b[0] * (1.0 - rest), &[(0, 1.0 - rest), (1, b[0] * x * rest)], 1.0);
        }
        Some(normal)
    };
    let fit = minimise(vec![500.0, 0.0001], &[true, true], curve).unwrap();
    assert!((fit.parameters[0] / 238.942_129_18 - 1.0).abs() < 1e-6, "{:?}", fit.parameters);
    assert!((fit.parameters[1] / 5.501_564_318_1e-4 - 1.0).abs() < 1e-6, "{:?}", fit.parameters);
    assert!(((fit.covariance[(0, 0)] * fit.misfit).sqrt() / 2.707_007_524_1 - 1.0).abs() < 1e-4);
}

#[test]
fn readings_that_do_not_tell_two_parameters_apart_give_no_fit() {
    let sum = |b: &[f64]| {
        let mut normal = Normal::new(2);
        for x in [1.0, 2.0, 3.0] {
            normal.add(x - b[0] * x - b[1] * x, &[(0, x), (1, x)], 1.0);
        }
        Some(normal)
    };
    assert!(minimise(vec![0.0, 0.0], &[true, true], sum).is_none());
}
