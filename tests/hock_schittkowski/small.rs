//! Problems 1 to 24: two variables.

use crate::collection::{D, Entry, INF, POSITIVE, ZERO, entry};
use num_dual::DualNum;
use std::f64::consts::PI;

fn valley(x: &[D]) -> D {
    (x[1] - x[0].powi(2)).powi(2) * 100.0 + (x[0] - 1.0).powi(2)
}

pub fn problems() -> Vec<Entry> {
    vec![
        entry(1, &[-2.0, 1.0], 0.0, |x| vec![valley(x)]).within(&[(-INF, INF), (-1.5, INF)]),
        entry(2, &[-2.0, 1.0], 0.050_426_187_9, |x| vec![valley(x)])
            .within(&[(-INF, INF), (1.5, INF)])
            .or(&[4.941_229_32]),
        entry(3, &[10.0, 1.0], 0.0, |x| vec![x[1] + (x[1] - x[0]).powi(2) * 1e-5]).within(&[(-INF, INF), (0.0, INF)]),
        entry(4, &[1.125, 0.125], 8.0 / 3.0, |x| vec![(x[0] + 1.0).powi(3) / 3.0 + x[1]])
            .within(&[(1.0, INF), (0.0, INF)]),
        entry(5, &[0.0, 0.0], -(3.0f64.sqrt()) / 2.0 - PI / 3.0, |x| {
            vec![(x[0] + x[1]).sin() + (x[0] - x[1]).powi(2) - x[0] * 1.5 + x[1] * 2.5 + 1.0]
        })
        .within(&[(-1.5, 4.0), (-3.0, 3.0)]),
        entry(6, &[-1.2, 1.0], 0.0, |x| vec![(x[0] - 1.0).powi(2), (x[1] - x[0].powi(2)) * 10.0]).under(&[ZERO]),
        entry(7, &[2.0, 2.0], -(3.0f64.sqrt()), |x| {
            vec![(x[0].powi(2) + 1.0).ln() - x[1], (x[0].powi(2) + 1.0).powi(2) + x[1].powi(2) - 4.0]
        })
        .under(&[ZERO]),
        entry(8, &[2.0, 1.0], -1.0, |x| vec![x[0] * 0.0 - 1.0, x[0].powi(2) + x[1].powi(2) - 25.0, x[0] * x[1] - 9.0])
            .under(&[ZERO; 2]),
        entry(9, &[0.0, 0.0], -0.5, |x| {
            vec![(x[0] * PI / 12.0).sin() * (x[1] * PI / 16.0).cos(), x[0] * 4.0 - x[1] * 3.0]
        })
        .under(&[ZERO]),
        entry(10, &[-10.0, 10.0], -1.0, |x| {
            vec![x[0] - x[1], x[0].powi(2) * -3.0 + x[0] * x[1] * 2.0 - x[1].powi(2) + 1.0]
        })
        .under(&[POSITIVE]),
        entry(11, &[4.9, 0.1], -8.498_464_223, |x| {
            vec![(x[0] - 5.0).powi(2) + x[1].powi(2) - 25.0, x[1] - x[0].powi(2)]
        })
        .under(&[POSITIVE]),
        entry(12, &[0.0, 0.0], -30.0, |x| {
            let objective = x[0].powi(2) * 0.5 + x[1].powi(2) - x[0] * x[1] - x[0] * 7.0 - x[1] * 7.0;
            vec![objective, x[0].powi(2) * -4.0 - x[1].powi(2) + 25.0]
        })
        .under(&[POSITIVE]),
        entry(14, &[2.0, 2.0], 9.0 - 2.875 * 7.0f64.sqrt(), |x| {
            vec![
                (x[0] - 2.0).powi(2) + (x[1] - 1.0).powi(2),
                x[0].powi(2) * -0.25 - x[1].powi(2) + 1.0,
                x[0] - x[1] * 2.0 + 1.0,
            ]
        })
        .under(&[POSITIVE, ZERO]),
        entry(15, &[-2.0, 1.0], 306.5, |x| vec![valley(x), x[0] * x[1] - 1.0, x[0] + x[1].powi(2)])
            .within(&[(-INF, 0.5), (-INF, INF)])
            .under(&[POSITIVE; 2])
            .or(&[360.379_767]),
        entry(16, &[-2.0, 1.0], 0.25, |x| vec![valley(x), x[0] + x[1].powi(2), x[0].powi(2) + x[1]])
            .within(&[(-0.5, 0.5), (-INF, 1.0)])
            .under(&[POSITIVE; 2])
            .or(&[23.144_661, 3.982_1]),
        entry(17, &[-2.0, 1.0], 1.0, |x| vec![valley(x), x[1].powi(2) - x[0], x[0].powi(2) - x[1]])
            .within(&[(-0.5, 0.5), (-INF, 1.0)])
            .under(&[POSITIVE; 2]),
        entry(18, &[2.0, 2.0], 5.0, |x| {
            vec![x[0].powi(2) * 0.01 + x[1].powi(2), x[0] * x[1] - 25.0, x[0].powi(2) + x[1].powi(2) - 25.0]
        })
        .within(&[(2.0, 50.0), (0.0, 50.0)])
        .under(&[POSITIVE; 2]),
        entry(19, &[20.1, 5.84], -6_961.813_81, |x| {
            vec![
                (x[0] - 10.0).powi(3) + (x[1] - 20.0).powi(3),
                (x[0] - 5.0).powi(2) + (x[1] - 5.0).powi(2) - 100.0,
                -(x[1] - 5.0).powi(2) - (x[0] - 6.0).powi(2) + 82.81,
            ]
        })
        .within(&[(13.0, 100.0), (0.0, 100.0)])
        .under(&[POSITIVE; 2]),
        entry(20, &[-2.0, 1.0], 81.5 - 25.0 * 3.0f64.sqrt(), |x| {
            vec![valley(x), x[0] + x[1].powi(2), x[0].powi(2) + x[1], x[0].powi(2) + x[1].powi(2) - 1.0]
        })
        .within(&[(-0.5, 0.5), (-INF, INF)])
        .under(&[POSITIVE; 3])
        .or(&[40.198_73]),
        entry(21, &[-1.0, -1.0], -99.96, |x| {
            vec![x[0].powi(2) * 0.01 + x[1].powi(2) - 100.0, x[0] * 10.0 - x[1] - 10.0]
        })
        .within(&[(2.0, 50.0), (-50.0, 50.0)])
        .under(&[POSITIVE]),
        entry(22, &[2.0, 2.0], 1.0, |x| {
            vec![(x[0] - 2.0).powi(2) + (x[1] - 1.0).powi(2), -x[0] - x[1] + 2.0, x[1] - x[0].powi(2)]
        })
        .under(&[POSITIVE; 2]),
        entry(23, &[3.0, 1.0], 2.0, |x| {
            let squares = x[0].powi(2) + x[1].powi(2);
            vec![
                squares,
                x[0] + x[1] - 1.0,
                squares - 1.0,
                x[0].powi(2) * 9.0 + x[1].powi(2) - 9.0,
                x[0].powi(2) - x[1],
                x[1].powi(2) - x[0],
            ]
        })
        .all_within(-50.0, 50.0)
        .under(&[POSITIVE; 5])
        .or(&[9.472_136]),
        entry(24, &[1.0, 0.5], -1.0, |x| {
            let root = 3.0f64.sqrt();
            vec![
                ((x[0] - 3.0).powi(2) - 9.0) * x[1].powi(3) / (27.0 * root),
                x[0] / root - x[1],
                x[0] + x[1] * root,
                -x[0] - x[1] * root + 6.0,
            ]
        })
        .all_within(0.0, INF)
        .under(&[POSITIVE; 3])
        .or(&[0.0]),
    ]
}
