//! The tables, the functions, and how much memory a query may take.

use std::sync::Arc;

use arrow::datatypes::DataType;
use datafusion::{
    catalog::TableProvider,
    datasource::{
        file_format::parquet::{ParquetFormat, transform_schema_to_view},
        listing::{ListingOptions, ListingTable, ListingTableConfig, ListingTableUrl},
    },
    error::Result,
    execution::{
        memory_pool::FairSpillPool,
        runtime_env::{RuntimeEnv, RuntimeEnvBuilder},
    },
    logical_expr::{AggregateUDF, ScalarUDF},
    prelude::{SQLOptions, SessionConfig, SessionContext},
};

use super::{Limits, image::Image, predicted::Predicted, response::Response, rms::Rms, runs::Runs};
use crate::{Place, columns};

/// The tables that there are.
pub(super) const TABLES: [&str; 4] = ["dwells", "frames", "presses", "runs"];

/// One row for each press: where and how deep it was, and its zeros, which are the mean image on the way down, while the tip is at least
/// 0.3 mm above the surface.
const PRESSES: &str = "
SELECT rig, date, run, press, min(t_ns) AS t_ns, min(indenter) AS indenter, min(covering_mm) AS covering_mm,
  avg(x_mm) FILTER (WHERE phase = 'hold') AS x_mm, avg(y_mm) FILTER (WHERE phase = 'hold') AS y_mm,
  -min(z_mm) AS deepest_mm, count(*) AS frames,
  image(counts) FILTER (WHERE phase = 'approach' AND z_mm > 0.3) AS zeros
FROM frames WHERE press >= 0 GROUP BY rig, date, run, press";

/// One row for each depth that a press held, to a hundredth of a mm.
const DWELLS: &str = "
SELECT rig, date, run, press, round(-z_mm, 2) AS depth_mm, min(t_ns) AS t_ns, count(*) AS frames, image(counts) AS image
FROM frames WHERE press >= 0 AND phase = 'hold' GROUP BY rig, date, run, press, round(-z_mm, 2)";

/// A query changes nothing.
pub(super) fn read_only() -> SQLOptions {
    SQLOptions::new().with_allow_ddl(false).with_allow_dml(false).with_allow_statements(false)
}

/// A session that knows the fleet.
pub(super) async fn session(place: &Place, limits: &Limits) -> Result<SessionContext> {
    let session = context(limits).await?;
    let folder = folder(place)?;
    session.register_object_store(folder.object_store().as_ref(), Arc::clone(place.store()));
    let frames: Arc<dyn TableProvider> = Arc::new(frames(folder)?);
    let runs: Arc<dyn TableProvider> = Arc::new(Runs::new(place.clone()));
    register_functions(&session);
    session.register_udtf("predicted", Arc::new(Predicted::new(Arc::clone(&frames), Arc::clone(&runs))));
    session.register_table("frames", frames)?;
    session.register_table("runs", runs)?;
    for (name, sql) in [("presses", PRESSES), ("dwells", DWELLS)] {
        session.register_table(name, session.sql(sql).await?.into_view())?;
    }
    Ok(session)
}

/// The functions of Tactus.
pub(crate) fn register_functions(session: &SessionContext) {
    session.register_udaf(AggregateUDF::new_from_impl(Image::new()));
    session.register_udf(ScalarUDF::new_from_impl(Response::new()));
    session.register_udf(ScalarUDF::new_from_impl(Rms::new()));
}

#[cfg(not(feature = "cluster"))]
async fn context(limits: &Limits) -> Result<SessionContext> {
    Ok(SessionContext::new_with_config_rt(config(limits), Arc::new(runtime(limits)?)))
}

/// Who runs the queries: this process, or a cluster.
#[cfg(feature = "cluster")]
async fn context(limits: &Limits) -> Result<SessionContext> {
    match &limits.cluster {
        Some(scheduler) => crate::cluster::session(*scheduler, config(limits)).await,
        None => Ok(SessionContext::new_with_config_rt(config(limits), Arc::new(runtime(limits)?))),
    }
}

fn config(limits: &Limits) -> SessionConfig {
    let mut config =
        SessionConfig::new().with_target_partitions(limits.threads.get()).with_information_schema(true);
    let options = config.options_mut();
    // So that an error can say where.
    options.sql_parser.collect_spans = true;
    // Counts are most of a file. They are unpacked only of rows that the other columns leave.
    options.execution.parquet.pushdown_filters = true;
    // What a sort keeps for merging what it put onto the disk. The library's 10 MB would be too much of a small limit.
    let reserved = &mut options.execution.sort_spill_reservation_bytes;
    *reserved = (*reserved).min(limits.memory_bytes / limits.threads.get() / 4);
    config
}

fn runtime(limits: &Limits) -> Result<RuntimeEnv> {
    let pool = FairSpillPool::new(limits.memory_bytes);
    RuntimeEnvBuilder::new().with_memory_pool(Arc::new(pool)).with_temp_file_path(&limits.spill).build()
}

/// The fleet's folder; an address without a slash at its end would be a file.
fn folder(place: &Place) -> Result<ListingTableUrl> {
    let mut url = place.url().clone();
    if !url.path().ends_with('/') {
        url.set_path(&format!("{}/", url.path()));
    }
    ListingTableUrl::try_new(url, None)
}

/// All rows. Rig and date come from the paths, and a condition on them leaves the other files unread.
fn frames(folder: ListingTableUrl) -> Result<ListingTable> {
    let options = ListingOptions::new(Arc::new(ParquetFormat::default()))
        .with_file_extension(".parquet")
        .with_table_partition_cols(vec![
            ("rig".to_owned(), DataType::Utf8View),
            ("date".to_owned(), DataType::Date32),
        ]);
    ListingTable::try_new(
        ListingTableConfig::new(folder)
            .with_listing_options(options)
            .with_schema(Arc::new(transform_schema_to_view(&columns::SCHEMA))),
    )
}
