//! Two mistakes for the validation layers to report. If they don't, they are not active.

use crate::Result;
use crate::statistics::{instance, refused};
use ash::vk;

/// Fills a buffer twice without a barrier (synchronization validation) and without the usage for it (validation).
pub(crate) fn provoke() -> Result<()> {
    let (_entry, instance) = instance()?;
    // SAFETY: the handles are valid, and the structures live until the calls return. The mistakes are harmless on the
    // software devices of the script: two writes of the same words.
    unsafe {
        for physical in instance.enumerate_physical_devices().map_err(refused("to list its devices"))? {
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues);
            let device = instance.create_device(physical, &info, None).map_err(refused("to open the device"))?;
            let info = vk::BufferCreateInfo::default().size(1024).usage(vk::BufferUsageFlags::STORAGE_BUFFER);
            let buffer = device.create_buffer(&info, None).map_err(refused("a buffer"))?;
            let needs = device.get_buffer_memory_requirements(buffer);
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needs.size)
                .memory_type_index(needs.memory_type_bits.trailing_zeros());
            let memory = device.allocate_memory(&info, None).map_err(refused("memory"))?;
            device.bind_buffer_memory(buffer, memory, 0).map_err(refused("to bind memory"))?;
            let pool =
                device.create_command_pool(&vk::CommandPoolCreateInfo::default(), None).map_err(refused("a pool"))?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let commands = device.allocate_command_buffers(&info).map_err(refused("commands"))?[0];
            device
                .begin_command_buffer(commands, &vk::CommandBufferBeginInfo::default())
                .map_err(refused("commands"))?;
            device.cmd_fill_buffer(commands, buffer, 0, 1024, 1);
            device.cmd_fill_buffer(commands, buffer, 0, 1024, 2);
            device.end_command_buffer(commands).map_err(refused("commands"))?;
            device.destroy_command_pool(pool, None);
            device.destroy_buffer(buffer, None);
            device.free_memory(memory, None);
            device.destroy_device(None);
        }
        instance.destroy_instance(None);
    }
    Ok(())
}
