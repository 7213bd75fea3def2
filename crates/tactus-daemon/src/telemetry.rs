//! Spans and metrics for an OpenTelemetry collector, over OTLP (HTTP, protobuf).
//!
//! Threads of their own send them, with a runtime of their own. What waits for them is bounded (2,048 spans), and the newest is dropped
//! when that is full: nothing of the service waits for a collector. Environment variables of the OpenTelemetry specification
//! (`OTEL_RESOURCE_ATTRIBUTES`, `OTEL_METRIC_EXPORT_INTERVAL`, `OTEL_BSP_*`) hold.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use http_body_util::{BodyExt as _, Full, Limited};
use hyper::client::conn::http1;
use hyper::header::{HOST, HeaderValue};
use hyper_util::rt::TokioIo;
use opentelemetry::metrics::Meter;
use opentelemetry::trace::TracerProvider as _;
use opentelemetry::{KeyValue, global};
use opentelemetry_http::{Bytes, HttpClient, HttpError, Request, Response};
use opentelemetry_otlp::{
    ExporterBuildError, MetricExporter, Protocol, SpanExporter, WithExportConfig as _, WithHttpConfig as _,
};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::metrics::SdkMeterProvider;
use opentelemetry_sdk::trace::SdkTracerProvider;
use tactus_log::Listener;
use tactus_runner::config::RigFiles;
use tactus_schema::pb;
use tokio::net::TcpStream;
use tokio::runtime::{Builder, Runtime};
use tokio::time::timeout;
use tracing::warn;

/// Where a collector on this machine listens.
pub(crate) const LOOPBACK: &str = "http://127.0.0.1:4318";
/// Time limit for one request to the collector.
const PATIENCE: Duration = Duration::from_secs(10);
/// Time limit for the last spans and metrics at the end of the program.
const LAST_PATIENCE: Duration = Duration::from_secs(1);
/// Longest answer of a collector.
const ANSWER_BYTES_MAX: usize = 1 << 20;
const TRACER: &str = "tactusd";

/// Why nothing can be sent.
#[derive(Debug, thiserror::Error)]
pub(crate) enum TelemetryError {
    #[error(
        "--otlp {url}: only http:// is spoken, such as {LOOPBACK}; a collector on this machine can pass it on with TLS"
    )]
    Scheme { url: String },
    #[error("--otlp {url}: {source}")]
    Exporter { url: String, source: ExporterBuildError },
    #[error("the system provides no runtime for --otlp: {0}")]
    Runtime(#[from] io::Error),
}

/// What is sent until the end of the program.
#[derive(Debug)]
pub(crate) struct Telemetry {
    spans: SdkTracerProvider,
    metrics: SdkMeterProvider,
}

impl Telemetry {
    /// Sends to a collector from here on, for a service of some rigs.
    pub(crate) fn start(url: &str, rigs: &[RigFiles]) -> Result<Self, TelemetryError> {
        if !url.starts_with("http://") {
            return Err(TelemetryError::Scheme { url: url.to_owned() });
        }
        let failed = |source| TelemetryError::Exporter { url: url.to_owned(), source };
        let at = |path: &str| format!("{}{path}", url.trim_end_matches('/'));
        let spans = SpanExporter::builder()
            .with_http()
            .with_http_client(Sender::new()?)
            .with_protocol(Protocol::HttpBinary)
            .with_endpoint(at("/v1/traces"))
            .build()
            .map_err(failed)?;
        let metrics = MetricExporter::builder()
            .with_http()
            .with_http_client(Sender::new()?)
            .with_protocol(Protocol::HttpBinary)
            .with_endpoint(at("/v1/metrics"))
            .build()
            .map_err(failed)?;
        let names: Vec<&str> = rigs.iter().map(|files| files.rig.name.as_str()).collect();
        let resource = Resource::builder()
            .with_service_name("tactusd")
            .with_attributes([
                KeyValue::new("service.version", env!("CARGO_PKG_VERSION")),
                KeyValue::new("tactus.rig", names.join(",")),
                KeyValue::new("tactus.simulated", rigs.iter().all(|files| files.rig.simulated)),
            ])
            .build();
        let spans =
            SdkTracerProvider::builder().with_resource(resource.clone()).with_batch_exporter(spans).build();
        let metrics =
            SdkMeterProvider::builder().with_resource(resource).with_periodic_exporter(metrics).build();
        global::set_meter_provider(metrics.clone());
        Ok(Self { spans, metrics })
    }

    /// Hears the program's spans.
    pub(crate) fn listener(&self) -> Listener {
        Box::new(tracing_opentelemetry::layer().with_tracer(self.spans.tracer(TRACER)))
    }
}

impl Drop for Telemetry {
    /// Sends the last; the program's end is more urgent than a collector that does not answer.
    fn drop(&mut self) {
        let metrics = self.metrics.shutdown_with_timeout(LAST_PATIENCE);
        let spans = self.spans.shutdown_with_timeout(LAST_PATIENCE);
        if let Err(error) = metrics.and(spans) {
            warn!(%error, "the last spans or metrics were not sent");
        }
    }
}

/// Tells the state of each rig that is up as often as metrics are sent; nothing if nobody collects them.
pub(crate) fn observe(healths: impl Fn() -> Vec<(Arc<str>, pb::Health)> + Clone + Send + Sync + 'static) {
    let meter: Meter = global::meter_provider().meter(TRACER);
    macro_rules! tell {
        ($kind:ident, $name:literal, $about:literal, $value:expr) => {{
            let (healths, value): (_, fn(&pb::Health) -> _) = (healths.clone(), $value);
            // The provider keeps it.
            let _kept = meter
                .$kind($name)
                .with_description($about)
                .with_callback(move |observer| {
                    for (rig, health) in healths() {
                        if let Some(value) = value(&health) {
                            observer.observe(value, &[KeyValue::new("tactus.rig", rig)]);
                        }
                    }
                })
                .build();
        }};
    }
    tell!(u64_observable_counter, "tactus.frames", "frames received since the service started", |health| {
        Some(health.frames)
    });
    tell!(
        u64_observable_counter,
        "tactus.frames.lost",
        "frames that the sensor took and that never arrived",
        |health| Some(health.frames_lost)
    );
    tell!(
        u64_observable_counter,
        "tactus.frames.dropped_on_bus",
        "frames dropped for slow subscribers",
        |health| Some(health.frames_dropped_on_bus)
    );
    tell!(u64_observable_gauge, "tactus.sensor.connected", "1 while the sensor is connected", |health| {
        Some(u64::from(health.sensor_connected))
    });
    tell!(u64_observable_gauge, "tactus.stage.connected", "1 while the stage is connected", |health| {
        Some(u64::from(health.stage_connected))
    });
    tell!(u64_observable_gauge, "tactus.lease.held", "1 while a client holds the lease", |health| {
        Some(u64::from(!health.lease_holder.is_empty()))
    });
    tell!(
        f64_observable_gauge,
        "tactus.clock.offset",
        "the device's clock against the host's, in s",
        |health| health.clock_offset_s
    );
    tell!(f64_observable_gauge, "tactus.clock.uncertainty", "uncertainty of that, in s", |health| health
        .clock_uncertainty_s);
}

/// Sends requests from whatever thread, without the service's runtime.
#[derive(Debug)]
struct Sender(Runtime);

impl Sender {
    fn new() -> io::Result<Self> {
        Ok(Self(Builder::new_current_thread().enable_all().build()?))
    }
}

#[async_trait]
impl HttpClient for Sender {
    /// Blocks; the exporters have threads of their own for it.
    async fn send_bytes(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        self.0.block_on(async { timeout(PATIENCE, send(request)).await? })
    }
}

/// Sends one request on a connection of its own: there is one in some seconds.
async fn send(request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
    let (mut head, body) = request.into_parts();
    let authority = head.uri.authority().cloned().ok_or("the collector's address has no host")?;
    head.headers.insert(HOST, HeaderValue::from_str(authority.as_str())?);
    head.uri = head.uri.path_and_query().map_or("/", |path| path.as_str()).parse()?;
    let stream = TcpStream::connect((authority.host(), authority.port_u16().unwrap_or(80))).await?;
    let (mut sender, connection) = http1::handshake(TokioIo::new(stream)).await?;
    let exchange = async {
        let answer = sender.send_request(Request::from_parts(head, Full::new(body))).await?;
        let (head, body) = answer.into_parts();
        let body = Limited::new(body, ANSWER_BYTES_MAX).collect().await?.to_bytes();
        Ok(Response::from_parts(head, body))
    };
    tokio::pin!(exchange);
    tokio::select! {
        answer = &mut exchange => answer,
        // The connection may end before the answer is taken from it.
        ended = connection => match ended {
            Ok(()) => exchange.await,
            Err(error) => Err(error.into()),
        },
    }
}

#[cfg(test)]
#[path = "telemetry_tests.rs"]
mod tests;
