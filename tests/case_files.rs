//! Case files under fire: whatever the text, an error or a case, never a panic.

use aeroform::case::{Case, builtin_cases};
use aeroform::design::DesignError;
use proptest::prelude::*;
use std::path::Path;

/// A built-in case with some of its bytes replaced, lines dropped or doubled.
fn mutated() -> impl Strategy<Value = String> {
    let edits = prop::collection::vec((any::<prop::sample::Index>(), "[ -~\n]{0,4}"), 0..4);
    let lines = prop::collection::vec((any::<prop::sample::Index>(), 0usize..3), 0..3);
    (any::<prop::sample::Index>(), edits, lines).prop_map(|(which, edits, lines)| {
        let mut text = which.get(builtin_cases()).text.to_string();
        for (at, new) in edits {
            let at = at.index(text.len());
            text.replace_range(at..(at + 1).min(text.len()), &new);
        }
        let mut rows: Vec<String> = text.lines().map(str::to_string).collect();
        for (at, copies) in lines {
            if rows.is_empty() {
                break;
            }
            let at = at.index(rows.len());
            let row = rows.remove(at);
            (0..copies).for_each(|_| rows.insert(at, row.clone()));
        }
        rows.join("\n")
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn mutated_cases_are_cases_or_errors(text in mutated()) {
        match Case::parse("fuzz.toml", &text, Path::new("")) {
            Ok(case) => {
                // a start without a flow is left for the run to tell
                let values = match case.problem.quantities_at(&case.problem.start_values()) {
                    Err(DesignError::FlowStatus { .. } | DesignError::Flow(_)) => return Ok(()),
                    values => values.unwrap(),
                };
                prop_assert!(values.iter().all(|v| v.is_finite()));
            }
            Err(error) => prop_assert!(error.to_string().starts_with("fuzz.toml")),
        }
    }

    #[test]
    fn any_text_is_an_error_or_a_case(text in "\\PC{0,200}") {
        let _ = Case::parse("fuzz.toml", &text, Path::new(""));
    }
}
