//! Whether this processor knows the instructions the command was compiled for.

use super::failure::Failure;

/// Refuses a processor on which the command would end in an illegal instruction.
#[cfg(all(target_arch = "x86_64", target_feature = "avx2"))]
pub(super) fn check() -> Result<(), Failure> {
    let id = raw_cpuid::CpuId::new();
    // the operating system has to keep the wide registers, too
    let avx = id.get_feature_info().is_some_and(|f| f.has_avx() && f.has_fma() && f.has_oxsave());
    let avx2 = id.get_extended_feature_info().is_some_and(|f| f.has_avx2() && f.has_bmi1() && f.has_bmi2());
    if avx && avx2 {
        return Ok(());
    }
    Err(Failure::Computation(
        "this build needs a processor with AVX2, FMA and BMI2; RUSTFLAGS=\"-C target-cpu=x86-64\" builds for all x86-64 processors".into(),
    ))
}

/// Built for every processor of its kind.
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx2")))]
pub(super) fn check() -> Result<(), Failure> {
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn what_runs_these_tests_is_fit() {
        assert!(super::check().is_ok());
    }
}
