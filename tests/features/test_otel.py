"""A collector gets the service's spans and metrics, and reads them with OpenTelemetry's own messages."""

import queue
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from lab import Lab, Process, tactus
from opentelemetry.proto.collector.metrics.v1.metrics_service_pb2 import ExportMetricsServiceRequest, ExportMetricsServiceResponse
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest, ExportTraceServiceResponse

REQUESTS = {
    "/v1/traces": (ExportTraceServiceRequest, ExportTraceServiceResponse),
    "/v1/metrics": (ExportMetricsServiceRequest, ExportMetricsServiceResponse),
}


@pytest.fixture
def collector():
    """A collector's address, and a queue of what it gets."""
    heard = queue.Queue()

    class Collector(BaseHTTPRequestHandler):
        def do_POST(self):
            request, response = REQUESTS[self.path]
            assert self.headers["content-type"] == "application/x-protobuf"
            heard.put(request.FromString(self.rfile.read(int(self.headers["content-length"]))))
            answer = response().SerializeToString()
            self.send_response(200)
            self.send_header("content-type", "application/x-protobuf")
            self.send_header("content-length", str(len(answer)))
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Collector)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}", heard
    server.shutdown()
    server.server_close()


@pytest.fixture
def told_lab(tmp_path, collector, monkeypatch):
    """A lab whose service tells the collector, often."""
    monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", collector[0])
    monkeypatch.setenv("OTEL_METRIC_EXPORT_INTERVAL", "200")
    monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "200")
    lab = Lab(tmp_path)
    yield lab
    lab.close()


def attributes(of):
    def value(one):
        return getattr(one, one.WhichOneof("value"))

    return {one.key: value(one.value) for one in of.attributes}


def test_a_run_is_a_trace_and_the_health_metrics(told_lab, collector):
    _, heard = collector
    script = "def run(rig):\n    tare()\n    press(5.1, 4.9, depths_mm = [0.2])\n"
    (told_lab.folder / "one.star").write_text(script)
    run = tactus("--endpoint", told_lab.endpoint, "run", "one.star", "--no-report", cwd=told_lab.folder)
    spans, metrics = {}, {}
    wanted = {"run", "step", "dry run", "command run", "command reset"}
    # Only a hang takes a minute.
    while not wanted <= set(spans) or metrics.get("tactus.frames", 0) <= run["frames"]:
        said = heard.get(timeout=60)
        parts = said.resource_spans if isinstance(said, ExportTraceServiceRequest) else said.resource_metrics
        for part in parts:
            resource = attributes(part.resource)
            assert (resource["service.name"], resource["tactus.rig"], resource["tactus.simulated"]) == ("tactusd", "bench", True)
        if isinstance(said, ExportTraceServiceRequest):
            for span in [span for part in parts for scope in part.scope_spans for span in scope.spans]:
                spans.setdefault(span.name, []).append(span)
        else:
            for metric in [metric for part in parts for scope in part.scope_metrics for metric in scope.metrics]:
                (point,) = getattr(metric, metric.WhichOneof("data")).data_points
                metrics[metric.name] = point.as_int if point.WhichOneof("value") == "as_int" else point.as_double
    (whole,) = spans["run"]
    about = attributes(whole)
    assert (about["run_id"], about["experiment"], about["exit_status"], about["presses"]) == (run["run_id"], "one", "done", 1)
    # All of it is one trace: the command, its dry run, the run, the steps.
    (command,) = spans["command run"]
    assert whole.parent_span_id == command.span_id == spans["dry run"][0].parent_span_id
    steps = spans["step"]
    assert {step.parent_span_id for step in steps} == {whole.span_id}
    assert {step.trace_id for step in steps} == {command.trace_id}
    assert any(attributes(step)["what"].startswith("press") for step in steps), [attributes(step) for step in steps]
    assert (metrics["tactus.frames.lost"], metrics["tactus.sensor.connected"], metrics["tactus.stage.connected"]) == (0, 1, 1)


def test_a_collector_that_is_not_there_delays_nothing(tmp_path, monkeypatch):
    # Nothing listens at port 9.
    monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", "http://127.0.0.1:9")
    lab = Lab(tmp_path)
    try:
        assert tactus("--endpoint", lab.endpoint, "status")["rig"] == "bench"
    finally:
        lab.close()


def test_what_cannot_be_spoken_is_a_usage_error(tmp_path, monkeypatch):
    lab = Lab(tmp_path)
    lab.close()
    for url, reason in [("https://collector.example", "only http://"), ("http://", "--otlp http://")]:
        service = Process("tactusd", ["--config", "tactusd.toml", "--otlp", url], tmp_path)
        assert reason in service.wait_for("--otlp")
        assert service.process.wait(timeout=60) == 2
        service.end()
