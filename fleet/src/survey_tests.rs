use super::*;

/// An analysis with a defect.
#[derive(Debug, Serialize, Deserialize)]
struct Defective;

impl Analysis for Defective {
    const NAME: &'static str = "defective";

    fn of(table: &Path) -> Result<Self, String> {
        panic!("no element of {}", table.display())
    }
}

#[test]
fn an_analysis_that_panics_refuses_its_run() {
    let Outcome::Refused(problem) = analysed::<Defective>(Path::new("run.parquet")) else { panic!() };
    assert_eq!(problem, "a defect of this program: no element of run.parquet");
}
