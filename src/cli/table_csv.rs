//! Tables as CSV text.

use super::failure::Failure;

/// Header and rows as CSV (RFC 4180), fields quoted where they need it.
pub(super) fn csv<R: AsRef<[String]>>(header: &[&str], rows: impl IntoIterator<Item = R>) -> Result<String, Failure> {
    let wrong = |e: &dyn std::fmt::Display| Failure::Computation(format!("the table cannot be written: {e}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header).map_err(|e| wrong(&e))?;
    for row in rows {
        writer.write_record(row.as_ref()).map_err(|e| wrong(&e))?;
    }
    let bytes = writer.into_inner().map_err(|e| wrong(&e))?;
    String::from_utf8(bytes).map_err(|e| wrong(&e))
}

#[cfg(test)]
mod tests {
    #[test]
    fn fields_are_quoted_where_they_need_it() {
        let rows = [["1".to_string(), "separated, \"far\"".to_string()]];
        assert_eq!(super::csv(&["alpha", "status"], rows).unwrap(), "alpha,status\n1,\"separated, \"\"far\"\"\"\n");
    }
}
