//! `aeroform cases`: the built-in cases.

use super::failure::Failure;
use super::output::{print, print_json};
use crate::case::{Case, builtin_cases};
use crate::report::json::{CaseEntry, CaseList};

/// Arguments of `aeroform cases`.
#[derive(Debug, clap::Args)]
pub(super) struct CasesArguments {
    /// Print the TOML text of this case, to start an own one from
    name: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

pub(super) fn run(arguments: &CasesArguments) -> Result<(), Failure> {
    if let Some(name) = &arguments.name {
        let case = builtin_cases().iter().find(|c| c.name == name);
        let missing = || Failure::Input(format!("there is no built-in case {name:?}; see `aeroform cases`"));
        return print(case.ok_or_else(missing)?.text);
    }
    let mut cases = Vec::new();
    for builtin in builtin_cases() {
        let case = Case::open(builtin.name)?;
        let variables = case.problem.geometry().variables().len();
        cases.push(CaseEntry { name: case.name, description: case.description, variables });
    }
    if arguments.json {
        return print_json(&CaseList { cases });
    }
    let width = cases.iter().map(|case| case.name.len()).max().unwrap_or(0);
    let line =
        |case: &CaseEntry| format!("{:width$}  {:4} variables  {}\n", case.name, case.variables, case.description);
    print(&cases.iter().map(line).collect::<String>())
}
