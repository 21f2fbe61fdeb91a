//! `aeroform cases`: the built-in cases.

use super::{Failure, print, print_json};
use crate::design::{Case, builtin_cases};
use serde_json::json;

/// Arguments of `aeroform cases`.
#[derive(Debug, clap::Args)]
pub(super) struct CasesArguments {
    /// Print the TOML text of this case, to start an own one from
    name: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &CasesArguments) -> Result<(), Failure> {
    if let Some(name) = &arguments.name {
        let case = builtin_cases().iter().find(|c| c.name == name);
        let missing = || Failure::Input(format!("there is no built-in case {name:?}; see `aeroform cases`"));
        return print(case.ok_or_else(missing)?.text);
    }
    let mut list = Vec::new();
    for builtin in builtin_cases() {
        let case = Case::open(builtin.name)?;
        list.push((case.name, case.description, case.problem.geometry().variables().len()));
    }
    if arguments.json {
        let cases: Vec<_> = list
            .iter()
            .map(|(name, description, variables)| {
                json!({ "name": name, "description": description, "variables": variables })
            })
            .collect();
        return print_json(&json!({ "cases": cases }));
    }
    let width = list.iter().map(|(name, ..)| name.len()).max().unwrap_or(0);
    let lines: String = list
        .iter()
        .map(|(name, description, variables)| format!("{name:width$}  {variables:4} variables  {description}\n"))
        .collect();
    print(&lines)
}
