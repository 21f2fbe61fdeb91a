//! Problems 71 to 113: four to ten variables.

use crate::collection::{D, Entry, FREE, INF, POSITIVE, ZERO, entry};
use num_dual::DualNum;

fn product(x: &[D]) -> D {
    x[1..].iter().fold(x[0], |product, x| product * *x)
}

/// The three equalities of problems 78, 80 and 81.
fn sphere_and_cubes(x: &[D]) -> [D; 3] {
    let squares = x[1..].iter().fold(x[0].powi(2), |sum, x| sum + x.powi(2));
    [squares - 10.0, x[1] * x[2] - x[3] * x[4] * 5.0, x[0].powi(3) + x[1].powi(3) + 1.0]
}

/// Problems 74 and 75, which differ in the reach of an angle.
fn network(x: &[D], reach: f64) -> Vec<D> {
    vec![
        x[0] * 3.0 + x[0].powi(3) * 1e-6 + x[1] * 2.0 + x[1].powi(3) * (2e-6 / 3.0),
        x[3] - x[2] + reach,
        x[2] - x[3] + reach,
        (-x[2] - 0.25).sin() * 1000.0 + (-x[3] - 0.25).sin() * 1000.0 + 894.8 - x[0],
        (x[2] - 0.25).sin() * 1000.0 + (x[2] - x[3] - 0.25).sin() * 1000.0 + 894.8 - x[1],
        (x[3] - 0.25).sin() * 1000.0 + (x[3] - x[2] - 0.25).sin() * 1000.0 + 1294.8,
    ]
}

pub fn problems() -> Vec<Entry> {
    let mut list = four_and_five();
    list.extend(six_to_ten());
    list
}

fn four_and_five() -> Vec<Entry> {
    let tight = [(-2.3, 2.3), (-2.3, 2.3), (-3.2, 3.2), (-3.2, 3.2), (-3.2, 3.2)];
    let network_of = |reach: f64| [(0.0, 1200.0), (0.0, 1200.0), (-reach, reach), (-reach, reach)];
    let network_rows = [POSITIVE, POSITIVE, ZERO, ZERO, ZERO];
    vec![
        entry(71, &[1.0, 5.0, 5.0, 1.0], 17.014_017_3, |x| {
            let squares = x[1..].iter().fold(x[0].powi(2), |sum, x| sum + x.powi(2));
            vec![x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2], product(x) - 25.0, squares - 40.0]
        })
        .all_within(1.0, 5.0)
        .under(&[POSITIVE, ZERO]),
        entry(72, &[1.0; 4], 727.679_37, |x| {
            let [a, b, c, d] = [x[0].recip(), x[1].recip(), x[2].recip(), x[3].recip()];
            vec![
                x[0] + x[1] + x[2] + x[3] + 1.0,
                a * -4.0 - b * 2.25 - c - d * 0.25 + 0.0401,
                a * -0.16 - b * 0.36 - c * 0.64 - d * 0.64 + 0.010_085,
            ]
        })
        .within(&[(0.001, 4e5), (0.001, 3e5), (0.001, 2e5), (0.001, 1e5)])
        .under(&[POSITIVE; 2]),
        entry(73, &[1.0; 4], 29.894_378, |x| {
            let spread = x[0].powi(2) * 0.28 + x[1].powi(2) * 0.19 + x[2].powi(2) * 20.5 + x[3].powi(2) * 0.62;
            vec![
                x[0] * 24.55 + x[1] * 26.75 + x[2] * 39.0 + x[3] * 40.5,
                x[0] * 2.3 + x[1] * 5.6 + x[2] * 11.1 + x[3] * 1.3 - 5.0,
                x[0] * 12.0 + x[1] * 11.9 + x[2] * 41.8 + x[3] * 52.1 - 21.0 - spread.sqrt() * 1.645,
                x[0] + x[1] + x[2] + x[3] - 1.0,
            ]
        })
        .all_within(0.0, INF)
        .under(&[POSITIVE, POSITIVE, ZERO]),
        entry(74, &[0.0; 4], 5_126.498_1, |x| network(x, 0.55)).within(&network_of(0.55)).under(&network_rows),
        entry(75, &[0.0; 4], 5_174.412_9, |x| network(x, 0.48)).within(&network_of(0.48)).under(&network_rows),
        entry(76, &[0.5; 4], -4.681_818_182, |x| {
            let quadratic = x[0].powi(2) + x[1].powi(2) * 0.5 + x[2].powi(2) + x[3].powi(2) * 0.5;
            vec![
                quadratic - x[0] * x[2] + x[2] * x[3] - x[0] - x[1] * 3.0 + x[2] - x[3],
                -x[0] - x[1] * 2.0 - x[2] - x[3] + 5.0,
                x[0] * -3.0 - x[1] - x[2] * 2.0 + x[3] + 4.0,
                x[1] + x[2] * 4.0 - 1.5,
            ]
        })
        .all_within(0.0, INF)
        .under(&[POSITIVE; 3]),
        entry(77, &[2.0; 5], 0.241_505_13, |x| {
            let root = 2.0f64.sqrt();
            let squares = (x[0] - 1.0).powi(2) + (x[0] - x[1]).powi(2) + (x[2] - 1.0).powi(2);
            vec![
                squares + (x[3] - 1.0).powi(4) + (x[4] - 1.0).powi(6),
                x[0].powi(2) * x[3] + (x[3] - x[4]).sin() - 2.0 * root,
                x[1] + x[2].powi(4) * x[3].powi(2) - 8.0 - root,
            ]
        })
        .under(&[ZERO; 2]),
        entry(78, &[-2.0, 1.5, 2.0, -1.0, -1.0], -2.919_700_41, |x| {
            let [a, b, c] = sphere_and_cubes(x);
            vec![product(x), a, b, c]
        })
        .under(&[ZERO; 3]),
        entry(79, &[2.0; 5], 0.078_776_820_9, |x| {
            let root = 2.0f64.sqrt();
            let squares = (x[0] - 1.0).powi(2) + (x[0] - x[1]).powi(2) + (x[1] - x[2]).powi(2);
            vec![
                squares + (x[2] - x[3]).powi(4) + (x[3] - x[4]).powi(4),
                x[0] + x[1].powi(2) + x[2].powi(3) - 2.0 - 3.0 * root,
                x[1] - x[2].powi(2) + x[3] + 2.0 - 2.0 * root,
                x[0] * x[4] - 2.0,
            ]
        })
        .under(&[ZERO; 3]),
        entry(80, &[-2.0, 2.0, 2.0, -1.0, -1.0], 0.053_949_847_8, |x| {
            let [a, b, c] = sphere_and_cubes(x);
            vec![product(x).exp(), a, b, c]
        })
        .within(&tight)
        .under(&[ZERO; 3])
        .or(&[0.438_851_2]),
        entry(81, &[-2.0, 2.0, 2.0, -1.0, -1.0], 0.053_949_847_8, |x| {
            let [a, b, c] = sphere_and_cubes(x);
            vec![product(x).exp() - c.powi(2) * 0.5, a, b, c]
        })
        .within(&tight)
        .under(&[ZERO; 3])
        .or(&[0.438_851_2]),
        entry(83, &[78.0, 33.0, 27.0, 27.0, 27.0], -30_665.538_67, |x| {
            vec![
                x[2].powi(2) * 5.357_854_7 + x[0] * x[4] * 0.835_689_1 + x[0] * 37.293_239 - 40_792.141,
                x[1] * x[4] * 0.005_685_8 + x[0] * x[3] * 0.000_626_2 - x[2] * x[4] * 0.002_205_3 + 85.334_407,
                x[1] * x[4] * 0.007_131_7 + x[0] * x[1] * 0.002_995_5 + x[2].powi(2) * 0.002_181_3 - 9.487_51,
                x[2] * x[4] * 0.004_702_6 + x[0] * x[2] * 0.001_254_7 + x[2] * x[3] * 0.001_908_5 - 10.699_039,
            ]
        })
        .within(&[(78.0, 102.0), (33.0, 45.0), (27.0, 45.0), (27.0, 45.0), (27.0, 45.0)])
        .under(&[(0.0, 92.0), (0.0, 20.0), (0.0, 5.0)]),
    ]
}

fn six_to_ten() -> Vec<Entry> {
    let above_zero_last = [FREE, FREE, FREE, FREE, FREE, FREE, FREE, FREE, (0.0, INF)];
    vec![
        entry(93, &[5.54, 4.4, 12.02, 11.82, 0.702, 0.852], 135.075_961, |x| {
            let (a, b) = (x[0] * x[3] * (x[0] + x[1] + x[2]), x[1] * x[2] * (x[0] + x[1] * 1.57 + x[3]));
            let (c, d) = (x[4].powi(2), x[5].powi(2));
            vec![
                a * 0.0204 + b * 0.0187 + a * c * 0.0607 + b * d * 0.0437,
                product(x) * 0.001 - 2.07,
                a * c * -0.000_62 - b * d * 0.000_58 + 1.0,
            ]
        })
        .all_within(0.0, INF)
        .under(&[POSITIVE; 2]),
        entry(100, &[1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0], 680.630_057_3, |x| {
            let squares = (x[0] - 10.0).powi(2) + (x[1] - 12.0).powi(2) * 5.0 + (x[3] - 11.0).powi(2) * 3.0;
            let powers = x[2].powi(4) + x[4].powi(6) * 10.0 + x[5].powi(2) * 7.0 + x[6].powi(4);
            let (a, b, c) = (x[0].powi(2), x[1].powi(2), x[2].powi(2));
            vec![
                squares + powers - x[5] * x[6] * 4.0 - x[5] * 10.0 - x[6] * 8.0,
                a * -2.0 - b.powi(2) * 3.0 - x[2] - x[3].powi(2) * 4.0 - x[4] * 5.0 + 127.0,
                x[0] * -7.0 - x[1] * 3.0 - c * 10.0 - x[3] + x[4] + 282.0,
                x[0] * -23.0 - b - x[5].powi(2) * 6.0 + x[6] * 8.0 + 196.0,
                a * -4.0 - b + x[0] * x[1] * 3.0 - c * 2.0 - x[5] * 5.0 + x[6] * 11.0,
            ]
        })
        .under(&[POSITIVE; 4]),
        entry(104, &[6.0, 3.0, 0.4, 0.2, 6.0, 6.0, 1.0, 0.5], 3.951_163_439_6, |x| {
            let ratio = |a: D, b: D| a.powf(0.67) * b.powf(-0.67) * 0.4;
            let objective = ratio(x[0], x[6]) + ratio(x[1], x[7]) + 10.0 - x[0] - x[1];
            let loss =
                |a: D, b: D, c: D| -(a / b) * 4.0 - (a.powf(0.71) * b).recip() * 2.0 - a.powf(-1.3) * c * 0.0588 + 1.0;
            vec![
                objective,
                x[4] * x[6] * -0.0588 - x[0] * 0.1 + 1.0,
                x[5] * x[7] * -0.0588 - x[0] * 0.1 - x[1] * 0.1 + 1.0,
                loss(x[2], x[4], x[6]),
                loss(x[3], x[5], x[7]),
                objective,
            ]
        })
        .all_within(0.1, 10.0)
        .under(&[POSITIVE, POSITIVE, POSITIVE, POSITIVE, (1.0, 4.2)]),
        entry(106, &[5000.0, 5000.0, 5000.0, 200.0, 350.0, 150.0, 225.0, 425.0], 7_049.330_923, |x| {
            vec![
                x[0] + x[1] + x[2],
                (x[3] + x[5]) * -0.0025 + 1.0,
                (x[4] + x[6] - x[3]) * -0.0025 + 1.0,
                (x[7] - x[4]) * -0.01 + 1.0,
                x[0] * x[5] - x[3] * 833.332_52 - x[0] * 100.0 + 83_333.333,
                x[1] * x[6] - x[4] * 1250.0 - x[1] * x[3] + x[3] * 1250.0,
                x[2] * x[7] - 1_250_000.0 - x[2] * x[4] + x[4] * 2500.0,
            ]
        })
        .within(&[
            (100.0, 1e4),
            (1e3, 1e4),
            (1e3, 1e4),
            (10.0, 1e3),
            (10.0, 1e3),
            (10.0, 1e3),
            (10.0, 1e3),
            (10.0, 1e3),
        ])
        .under(&[POSITIVE; 6]),
        entry(108, &[1.0; 9], -0.866_025_403_8, |x| {
            let apart = |i: usize, j: usize| -(x[i - 1] - x[j - 1]).powi(2) - (x[i] - x[j]).powi(2) + 1.0;
            let area = x[0] * x[3] - x[1] * x[2] + x[2] * x[8] - x[4] * x[8] + x[4] * x[7] - x[5] * x[6];
            vec![
                area * -0.5,
                -x[2].powi(2) - x[3].powi(2) + 1.0,
                -x[8].powi(2) + 1.0,
                -x[4].powi(2) - x[5].powi(2) + 1.0,
                -x[0].powi(2) - (x[1] - x[8]).powi(2) + 1.0,
                apart(1, 5),
                apart(1, 7),
                apart(3, 5),
                apart(3, 7),
                -x[6].powi(2) - (x[7] - x[8]).powi(2) + 1.0,
                x[0] * x[3] - x[1] * x[2],
                x[2] * x[8],
                -x[4] * x[8],
                x[4] * x[7] - x[5] * x[6],
            ]
        })
        .within(&above_zero_last)
        .under(&[POSITIVE; 13])
        .or(&[-0.674_981_4, -0.5, 0.0]),
        entry(110, &[9.0; 10], -45.778_469_71, |x| {
            let logs = x.iter().fold(x[0] * 0.0, |sum, x| sum + (*x - 2.0).ln().powi(2) + (-*x + 10.0).ln().powi(2));
            vec![logs - product(x).powf(0.2)]
        })
        .all_within(2.001, 9.999),
        entry(113, &[2.0, 3.0, 5.0, 5.0, 1.0, 2.0, 7.0, 3.0, 6.0, 10.0], 24.306_209_1, |x| {
            let square = |k: usize, at: f64| (x[k] - at).powi(2);
            let first = x[0].powi(2) + x[1].powi(2) + x[0] * x[1] - x[0] * 14.0 - x[1] * 16.0;
            let middle = square(2, 10.0) + square(3, 5.0) * 4.0 + square(4, 3.0) + square(5, 1.0) * 2.0;
            let last = x[6].powi(2) * 5.0 + square(7, 11.0) * 7.0 + square(8, 10.0) * 2.0 + square(9, 7.0) + 45.0;
            vec![
                first + middle + last,
                x[0] * -4.0 - x[1] * 5.0 + x[6] * 3.0 - x[7] * 9.0 + 105.0,
                x[0] * -10.0 + x[1] * 8.0 + x[6] * 17.0 - x[7] * 2.0,
                x[0] * 8.0 - x[1] * 2.0 - x[8] * 5.0 + x[9] * 2.0 + 12.0,
                square(0, 2.0) * -3.0 - square(1, 3.0) * 4.0 - x[2].powi(2) * 2.0 + x[3] * 7.0 + 120.0,
                x[0].powi(2) * -5.0 - x[1] * 8.0 - square(2, 6.0) + x[3] * 2.0 + 40.0,
                square(0, 8.0) * -0.5 - square(1, 4.0) * 2.0 - x[4].powi(2) * 3.0 + x[5] + 30.0,
                -x[0].powi(2) - square(1, 2.0) * 2.0 + x[0] * x[1] * 2.0 - x[4] * 14.0 + x[5] * 6.0,
                x[0] * 3.0 - x[1] * 6.0 - square(8, 8.0) * 12.0 + x[9] * 7.0,
            ]
        })
        .under(&[POSITIVE; 8]),
    ]
}
