//! Reads the pixels of a finished frame, or the words of a buffer, back from the device.

use std::sync::{Arc, Mutex};

use bevy::render::{
    render_resource::{
        Buffer, BufferAsyncError, BufferDescriptor, BufferUsages, CommandEncoderDescriptor, Extent3d, MapMode,
        PollType, TexelCopyBufferInfo, TexelCopyBufferLayout, Texture,
    },
    renderer::{RenderDevice, RenderQueue},
};

/// Why an image could not be read back.
#[derive(Debug, thiserror::Error)]
pub enum ReadbackError {
    /// Waiting for the device failed.
    #[error("the image could not be read back: {0}")]
    Wait(#[from] wgpu::PollError),
    /// The device refused to map the buffer.
    #[error("the image could not be read back: {0}")]
    Map(#[from] BufferAsyncError),
    /// The device finished without an answer.
    #[error("the image could not be read back: the device did not answer")]
    NoAnswer,
}

/// The first `words` words of `buffer`, which must allow copies. Waits until the device has finished everything that was
/// submitted.
///
/// # Errors
/// [`ReadbackError`] if the device is lost or out of memory.
pub fn read_words(
    device: &RenderDevice,
    queue: &RenderQueue,
    buffer: &Buffer,
    words: usize,
) -> Result<Vec<u32>, ReadbackError> {
    let bytes = (4 * words as u64).min(buffer.size());
    let copy = device.create_buffer(&BufferDescriptor {
        label: Some("canopy_readback"),
        size: bytes.max(4),
        usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, bytes);
    queue.submit([encoder.finish()]);
    wait_for(device, &copy)?;
    let mut all: Vec<u32> = bytemuck::pod_collect_to_vec(&copy.slice(..).get_mapped_range());
    all.truncate(words);
    Ok(all)
}

/// Maps `buffer` for reading, and waits until it is.
fn wait_for(device: &RenderDevice, buffer: &Buffer) -> Result<(), ReadbackError> {
    let outcome = Arc::new(Mutex::new(None));
    let shared = outcome.clone();
    buffer.slice(..).map_async(MapMode::Read, move |result| {
        if let Ok(mut slot) = shared.lock() {
            *slot = Some(result);
        }
    });
    device.wgpu_device().poll(PollType::Wait { submission_index: None, timeout: None })?;
    let mapped = outcome.lock().ok().and_then(|mut slot| slot.take());
    mapped.ok_or(ReadbackError::NoAnswer)??;
    Ok(())
}

/// The first layer of `texture`, whose format has four bytes per pixel, without its fourth channel: three bytes per
/// pixel, row by row from the top. Waits until the device has finished everything that was submitted.
///
/// # Errors
/// [`ReadbackError`] if the device is lost or out of memory.
pub fn read_rgb(device: &RenderDevice, queue: &RenderQueue, texture: &Texture) -> Result<Vec<u8>, ReadbackError> {
    let (width, height) = (texture.width(), texture.height());
    let row = RenderDevice::align_copy_bytes_per_row(4 * width as usize);
    let buffer = device.create_buffer(&BufferDescriptor {
        label: Some("canopy_readback"),
        size: row as u64 * u64::from(height),
        usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        TexelCopyBufferInfo {
            buffer: &buffer,
            layout: TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row as u32), rows_per_image: None },
        },
        Extent3d { width, height, depth_or_array_layers: 1 },
    );
    queue.submit([encoder.finish()]);
    wait_for(device, &buffer)?;
    let slice = buffer.slice(..);
    let mut pixels = Vec::with_capacity(3 * width as usize * height as usize);
    for line in slice.get_mapped_range().chunks_exact(row) {
        for pixel in line[..4 * width as usize].chunks_exact(4) {
            pixels.extend_from_slice(&pixel[..3]);
        }
    }
    Ok(pixels)
}
