//! Publishes the engine's frames, states and events on the bus.

use tactus_bus::Publisher;
use tactus_engine::Publish;
use tactus_schema::{Frame, pb};

pub(super) struct BusPublisher(pub(super) Publisher);

impl Publish for BusPublisher {
    fn sensor_info(&self, info: &pb::SensorInfo) {
        self.0.publish(info);
    }

    fn frame(&self, frame: &Frame) {
        self.0.publish_frame(frame);
    }

    fn frame_at_rest(&self, frame: &Frame) {
        self.0.publish_frame_directly(frame);
    }

    fn stage(&self, state: &pb::StageState) {
        self.0.publish(state);
    }

    fn event(&self, event: &pb::RunEvent) {
        self.0.publish(event);
    }

    fn state(&self, state: &pb::RunState) {
        self.0.publish(state);
    }

    fn safety(&self, event: &pb::SafetyEvent) {
        self.0.publish(event);
    }
}
