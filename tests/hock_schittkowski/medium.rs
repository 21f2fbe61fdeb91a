//! Problems 26 to 45: three to five variables.

use crate::collection::{D, Entry, INF, POSITIVE, ZERO, entry};
use num_dual::DualNum;

fn squares(x: &[D]) -> D {
    x.iter().fold(x[0] * 0.0, |sum, x| sum + x.powi(2))
}

pub fn problems() -> Vec<Entry> {
    vec![
        entry(26, &[-2.6, 2.0, 2.0], 0.0, |x| {
            vec![(x[0] - x[1]).powi(2) + (x[1] - x[2]).powi(4), (x[1].powi(2) + 1.0) * x[0] + x[2].powi(4) - 3.0]
        })
        .under(&[ZERO]),
        entry(27, &[2.0, 2.0, 2.0], 0.04, |x| {
            vec![(x[0] - 1.0).powi(2) * 0.01 + (x[1] - x[0].powi(2)).powi(2), x[0] + x[2].powi(2) + 1.0]
        })
        .under(&[ZERO]),
        entry(28, &[-4.0, 1.0, 1.0], 0.0, |x| {
            vec![(x[0] + x[1]).powi(2) + (x[1] + x[2]).powi(2), x[0] + x[1] * 2.0 + x[2] * 3.0 - 1.0]
        })
        .under(&[ZERO]),
        entry(29, &[1.0, 1.0, 1.0], -16.0 * 2.0f64.sqrt(), |x| {
            vec![-x[0] * x[1] * x[2], x[0].powi(2) * -1.0 - x[1].powi(2) * 2.0 - x[2].powi(2) * 4.0 + 48.0]
        })
        .under(&[POSITIVE]),
        entry(30, &[1.0, 1.0, 1.0], 1.0, |x| vec![squares(x), x[0].powi(2) + x[1].powi(2) - 1.0])
            .within(&[(1.0, 10.0), (-10.0, 10.0), (-10.0, 10.0)])
            .under(&[POSITIVE]),
        entry(31, &[1.0, 1.0, 1.0], 6.0, |x| {
            vec![x[0].powi(2) * 9.0 + x[1].powi(2) + x[2].powi(2) * 9.0, x[0] * x[1] - 1.0]
        })
        .within(&[(-10.0, 10.0), (1.0, 10.0), (-10.0, 1.0)])
        .under(&[POSITIVE]),
        entry(32, &[0.1, 0.7, 0.2], 1.0, |x| {
            vec![
                (x[0] + x[1] * 3.0 + x[2]).powi(2) + (x[0] - x[1]).powi(2) * 4.0,
                x[1] * 6.0 + x[2] * 4.0 - x[0].powi(3) - 3.0,
                -x[0] - x[1] - x[2] + 1.0,
            ]
        })
        .all_within(0.0, INF)
        .under(&[POSITIVE, ZERO]),
        entry(33, &[0.0, 0.0, 3.0], 2.0f64.sqrt() - 6.0, |x| {
            vec![
                (x[0] - 1.0) * (x[0] - 2.0) * (x[0] - 3.0) + x[2],
                x[2].powi(2) - x[1].powi(2) - x[0].powi(2),
                squares(x) - 4.0,
            ]
        })
        .within(&[(0.0, INF), (0.0, INF), (0.0, 5.0)])
        .under(&[POSITIVE; 2])
        .or(&[-4.0]),
        entry(34, &[0.0, 1.05, 2.9], -(10.0f64.ln().ln()), |x| vec![-x[0], x[1] - x[0].exp(), x[2] - x[1].exp()])
            .within(&[(0.0, 100.0), (0.0, 100.0), (0.0, 10.0)])
            .under(&[POSITIVE; 2]),
        entry(35, &[0.5, 0.5, 0.5], 1.0 / 9.0, |x| {
            let quadratic = x[0].powi(2) * 2.0 + x[1].powi(2) * 2.0 + x[2].powi(2);
            let mixed = x[0] * x[1] * 2.0 + x[0] * x[2] * 2.0;
            vec![x[0] * -8.0 - x[1] * 6.0 - x[2] * 4.0 + 9.0 + quadratic + mixed, -x[0] - x[1] - x[2] * 2.0 + 3.0]
        })
        .all_within(0.0, INF)
        .under(&[POSITIVE]),
        entry(36, &[10.0, 10.0, 10.0], -3300.0, |x| vec![-x[0] * x[1] * x[2], -x[0] - x[1] * 2.0 - x[2] * 2.0 + 72.0])
            .within(&[(0.0, 20.0), (0.0, 11.0), (0.0, 42.0)])
            .under(&[POSITIVE]),
        entry(37, &[10.0, 10.0, 10.0], -3456.0, |x| {
            let sum = x[0] + x[1] * 2.0 + x[2] * 2.0;
            vec![-x[0] * x[1] * x[2], -sum + 72.0, sum]
        })
        .all_within(0.0, 42.0)
        .under(&[POSITIVE; 2]),
        entry(38, &[-3.0, -1.0, -3.0, -1.0], 0.0, |x| {
            let valleys = (x[1] - x[0].powi(2)).powi(2) * 100.0
                + (x[0] - 1.0).powi(2)
                + (x[3] - x[2].powi(2)).powi(2) * 90.0
                + (x[2] - 1.0).powi(2);
            let joined = ((x[1] - 1.0).powi(2) + (x[3] - 1.0).powi(2)) * 10.1 + (x[1] - 1.0) * (x[3] - 1.0) * 19.8;
            vec![valleys + joined]
        })
        .all_within(-10.0, 10.0),
        entry(39, &[2.0; 4], -1.0, |x| {
            vec![-x[0], x[1] - x[0].powi(3) - x[2].powi(2), x[0].powi(2) - x[1] - x[3].powi(2)]
        })
        .under(&[ZERO; 2]),
        entry(40, &[0.8; 4], -0.25, |x| {
            vec![
                -x[0] * x[1] * x[2] * x[3],
                x[0].powi(3) + x[1].powi(2) - 1.0,
                x[0].powi(2) * x[3] - x[2],
                x[3].powi(2) - x[1],
            ]
        })
        .under(&[ZERO; 3]),
        entry(41, &[2.0; 4], 52.0 / 27.0, |x| vec![-x[0] * x[1] * x[2] + 2.0, x[0] + x[1] * 2.0 + x[2] * 2.0 - x[3]])
            .within(&[(0.0, 1.0), (0.0, 1.0), (0.0, 1.0), (0.0, 2.0)])
            .under(&[ZERO]),
        entry(42, &[1.0; 4], 28.0 - 10.0 * 2.0f64.sqrt(), |x| {
            let distance = |k: usize| (x[k] - (k + 1) as f64).powi(2);
            vec![distance(0) + distance(1) + distance(2) + distance(3), x[0] - 2.0, x[2].powi(2) + x[3].powi(2) - 2.0]
        })
        .under(&[ZERO; 2]),
        entry(43, &[0.0; 4], -44.0, |x| {
            vec![
                squares(x) + x[2].powi(2) - x[0] * 5.0 - x[1] * 5.0 - x[2] * 21.0 + x[3] * 7.0,
                -squares(x) - x[0] + x[1] - x[2] + x[3] + 8.0,
                -squares(x) - x[1].powi(2) - x[3].powi(2) + x[0] + x[3] + 10.0,
                -squares(&x[..3]) - x[0].powi(2) - x[0] * 2.0 + x[1] + x[3] + 5.0,
            ]
        })
        .under(&[POSITIVE; 3]),
        entry(44, &[0.0; 4], -15.0, |x| {
            vec![
                x[0] - x[1] - x[2] - x[0] * x[2] + x[0] * x[3] + x[1] * x[2] - x[1] * x[3],
                -x[0] - x[1] * 2.0 + 8.0,
                x[0] * -4.0 - x[1] + 12.0,
                x[0] * -3.0 - x[1] * 4.0 + 12.0,
                x[2] * -2.0 - x[3] + 8.0,
                -x[2] - x[3] * 2.0 + 8.0,
                -x[2] - x[3] + 5.0,
            ]
        })
        .all_within(0.0, INF)
        .under(&[POSITIVE; 6])
        .or(&[-13.0]),
        entry(45, &[2.0; 5], 1.0, |x| vec![-x[0] * x[1] * x[2] * x[3] * x[4] / 120.0 + 2.0]).within(&[
            (0.0, 1.0),
            (0.0, 2.0),
            (0.0, 3.0),
            (0.0, 4.0),
            (0.0, 5.0),
        ]),
    ]
}
