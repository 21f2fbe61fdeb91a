//! Problems 46 to 66: most of them under equalities.

use crate::collection::{Entry, INF, POSITIVE, ZERO, entry};
use num_dual::DualNum;

pub fn problems() -> Vec<Entry> {
    let root = 2.0f64.sqrt();
    let (a, b) = ((1.0f64 / 4.2).sqrt().asin(), (5.0f64 / 7.2).sqrt().asin());
    vec![
        entry(46, &[root / 2.0, 1.75, 0.5, 2.0, 2.0], 0.0, |x| {
            vec![
                (x[0] - x[1]).powi(2) + (x[2] - 1.0).powi(2) + (x[3] - 1.0).powi(4) + (x[4] - 1.0).powi(6),
                x[0].powi(2) * x[3] + (x[3] - x[4]).sin() - 1.0,
                x[1] + x[2].powi(4) * x[3].powi(2) - 2.0,
            ]
        })
        .under(&[ZERO; 2]),
        entry(48, &[3.0, 5.0, -3.0, 2.0, -2.0], 0.0, |x| {
            vec![
                (x[0] - 1.0).powi(2) + (x[1] - x[2]).powi(2) + (x[3] - x[4]).powi(2),
                x[0] + x[1] + x[2] + x[3] + x[4] - 5.0,
                x[2] - (x[3] + x[4]) * 2.0 + 3.0,
            ]
        })
        .under(&[ZERO; 2]),
        entry(49, &[10.0, 7.0, 2.0, -3.0, 0.8], 0.0, |x| {
            vec![
                (x[0] - x[1]).powi(2) + (x[2] - 1.0).powi(2) + (x[3] - 1.0).powi(4) + (x[4] - 1.0).powi(6),
                x[0] + x[1] + x[2] + x[3] * 4.0 - 7.0,
                x[2] + x[4] * 5.0 - 6.0,
            ]
        })
        .under(&[ZERO; 2]),
        entry(50, &[35.0, -31.0, 11.0, 5.0, -5.0], 0.0, |x| {
            vec![
                (x[0] - x[1]).powi(2) + (x[1] - x[2]).powi(2) + (x[2] - x[3]).powi(4) + (x[3] - x[4]).powi(2),
                x[0] + x[1] * 2.0 + x[2] * 3.0 - 6.0,
                x[1] + x[2] * 2.0 + x[3] * 3.0 - 6.0,
                x[2] + x[3] * 2.0 + x[4] * 3.0 - 6.0,
            ]
        })
        .under(&[ZERO; 3]),
        entry(51, &[2.5, 0.5, 2.0, -1.0, 0.5], 0.0, |x| {
            let objective =
                (x[0] - x[1]).powi(2) + (x[1] + x[2] - 2.0).powi(2) + (x[3] - 1.0).powi(2) + (x[4] - 1.0).powi(2);
            vec![objective, x[0] + x[1] * 3.0 - 4.0, x[2] + x[3] - x[4] * 2.0, x[1] - x[4]]
        })
        .under(&[ZERO; 3]),
        entry(52, &[2.0; 5], 1859.0 / 349.0, |x| {
            let first = (x[0] * 4.0 - x[1]).powi(2);
            let objective = first + (x[1] + x[2] - 2.0).powi(2) + (x[3] - 1.0).powi(2) + (x[4] - 1.0).powi(2);
            vec![objective, x[0] + x[1] * 3.0, x[2] + x[3] - x[4] * 2.0, x[1] - x[4]]
        })
        .under(&[ZERO; 3]),
        entry(53, &[2.0; 5], 176.0 / 43.0, |x| {
            let objective =
                (x[0] - x[1]).powi(2) + (x[1] + x[2] - 2.0).powi(2) + (x[3] - 1.0).powi(2) + (x[4] - 1.0).powi(2);
            vec![objective, x[0] + x[1] * 3.0, x[2] + x[3] - x[4] * 2.0, x[1] - x[4]]
        })
        .all_within(-10.0, 10.0)
        .under(&[ZERO; 3]),
        // its equalities depend on each other: the sum of the second and third is that of the last three
        entry(55, &[1.0, 2.0, 0.0, 0.0, 0.0, 2.0], 19.0 / 3.0, |x| {
            vec![
                x[0] + x[1] * 2.0 + x[4] * 4.0 + (x[0] * x[3]).exp(),
                x[0] + x[1] * 2.0 + x[4] * 5.0 - 6.0,
                x[0] + x[1] + x[2] - 3.0,
                x[3] + x[4] + x[5] - 2.0,
                x[0] + x[3] - 1.0,
                x[1] + x[4] - 2.0,
                x[2] + x[5] - 2.0,
            ]
        })
        .within(&[(0.0, 1.0), (0.0, INF), (0.0, INF), (0.0, 1.0), (0.0, INF), (0.0, INF)])
        .under(&[ZERO; 6])
        .or(&[20.0 / 3.0]),
        entry(56, &[1.0, 1.0, 1.0, a, a, a, b], -3.456, |x| {
            vec![
                -x[0] * x[1] * x[2],
                x[0] - x[3].sin().powi(2) * 4.2,
                x[1] - x[4].sin().powi(2) * 4.2,
                x[2] - x[5].sin().powi(2) * 4.2,
                x[0] + x[1] * 2.0 + x[2] * 2.0 - x[6].sin().powi(2) * 7.2,
            ]
        })
        .under(&[ZERO; 4]),
        entry(60, &[2.0; 3], 0.032_568_200_25, |x| {
            vec![
                (x[0] - 1.0).powi(2) + (x[0] - x[1]).powi(2) + (x[1] - x[2]).powi(4),
                x[0] * (x[1].powi(2) + 1.0) + x[2].powi(4) - 4.0 - 3.0 * 2.0f64.sqrt(),
            ]
        })
        .all_within(-10.0, 10.0)
        .under(&[ZERO]),
        entry(61, &[0.0; 3], -143.646_142_2, |x| {
            vec![
                x[0].powi(2) * 4.0 + x[1].powi(2) * 2.0 + x[2].powi(2) * 2.0 - x[0] * 33.0 + x[1] * 16.0 - x[2] * 24.0,
                x[0] * 3.0 - x[1].powi(2) * 2.0 - 7.0,
                x[0] * 4.0 - x[2].powi(2) - 11.0,
            ]
        })
        .under(&[ZERO; 2]),
        entry(62, &[0.7, 0.2, 0.1], -26_272.514_48, |x| {
            let (third, second, sum) = (x[2] + 0.03, x[1] + x[2] + 0.03, x[0] + x[1] + x[2] + 0.03);
            let first = (sum / (x[0] * 0.09 + x[1] + x[2] + 0.03)).ln() * 255.0;
            let middle = (second / (x[1] * 0.07 + x[2] + 0.03)).ln() * 280.0;
            let last = (third / (x[2] * 0.13 + 0.03)).ln() * 290.0;
            vec![(first + middle + last) * -32.174, x[0] + x[1] + x[2] - 1.0]
        })
        .all_within(0.0, 1.0)
        .under(&[ZERO]),
        entry(63, &[2.0; 3], 961.715_172_1, |x| {
            let quadratic = x[0].powi(2) + x[1].powi(2) * 2.0 + x[2].powi(2) + x[0] * x[1] + x[0] * x[2];
            vec![
                -quadratic + 1000.0,
                x[0] * 8.0 + x[1] * 14.0 + x[2] * 7.0 - 56.0,
                x[0].powi(2) + x[1].powi(2) + x[2].powi(2) - 25.0,
            ]
        })
        .all_within(0.0, INF)
        .under(&[ZERO; 2]),
        entry(64, &[1.0; 3], 6_299.842_428, |x| {
            let [a, b, c] = [x[0].recip(), x[1].recip(), x[2].recip()];
            vec![
                x[0] * 5.0 + a * 5e4 + x[1] * 20.0 + b * 7.2e4 + x[2] * 10.0 + c * 1.44e5,
                a * -4.0 - b * 32.0 - c * 120.0 + 1.0,
            ]
        })
        .all_within(1e-5, INF)
        .under(&[POSITIVE]),
        entry(65, &[-5.0, 5.0, 0.0], 0.953_528_856_7, |x| {
            vec![
                (x[0] - x[1]).powi(2) + (x[0] + x[1] - 10.0).powi(2) / 9.0 + (x[2] - 5.0).powi(2),
                -x[0].powi(2) - x[1].powi(2) - x[2].powi(2) + 48.0,
            ]
        })
        .within(&[(-4.5, 4.5), (-4.5, 4.5), (-5.0, 5.0)])
        .under(&[POSITIVE]),
        entry(66, &[0.0, 1.05, 2.9], 0.518_163_274_1, |x| {
            vec![x[2] * 0.2 - x[0] * 0.8, x[1] - x[0].exp(), x[2] - x[1].exp()]
        })
        .within(&[(0.0, 100.0), (0.0, 100.0), (0.0, 10.0)])
        .under(&[POSITIVE; 2]),
    ]
}
