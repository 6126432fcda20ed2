"""What the panel's buttons do. All can be undone, run from scripts, and report what goes wrong."""

from contextlib import contextmanager

import bpy
from bpy_extras.io_utils import ExportHelper

from . import bake, live, render_mesh
from .inputs import Refused, evaluated, rest_positions, split_matrix

TICK = 0.05  # seconds between looks at a precompute under way


def is_shell(context):
    obj = context.object
    return obj is not None and obj.type == "MESH" and obj.shellwarp.enabled


class ShellOperator:
    """Mixin: needs a shell, turns what is raised into a report."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return is_shell(context)

    def execute(self, context):
        try:
            done = self.run(context, context.object) or {"FINISHED"}
        except Exception as error:
            return refused(self, context.object, error)
        live.refuse(context.object, self.bl_label, "")
        return done


def refused(operator, obj, error):
    """Reports why a button did not do its work, and keeps it for the panel."""
    text = str(error) or type(error).__name__
    operator.report({"ERROR"}, text)
    if obj is not None:
        live.refuse(obj, operator.bl_label, text)
    return {"CANCELLED"}


class SHELLWARP_OT_precompute(ShellOperator, bpy.types.Operator):
    """Find the shell's modes now rather than at the start frame. Esc stops it"""

    bl_idname = "shellwarp.precompute"
    bl_label = "Precompute"

    def run(self, context, obj):
        run = live.prepare(obj, context.evaluated_depsgraph_get())
        self.report({"INFO"}, summary(run))

    def invoke(self, context, _event):
        """The modes are found on a thread."""
        try:
            self.job = live.start(context.object, context.evaluated_depsgraph_get())
            if self.job is None:
                return self.execute(context)
        except Exception as error:
            return refused(self, context.object, error)
        self.name, self.uid = context.object.name, context.object.session_uid
        begin_modal(self, context, TICK)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self.job.cancel()
        if event.type == "TIMER":
            show_progress(context, self.job.fraction, f"{self.name}: {self.job.text()}")
        if self.job.running():
            return {"RUNNING_MODAL"}
        end_modal(self, context)
        obj = live.find(self.uid)
        if self.job.cancelled:
            if obj is not None and live.job(obj) is self.job:
                live.stop(obj)
            self.report({"ERROR"}, "the precompute was cancelled")
            return {"CANCELLED"}
        try:
            if obj is None:
                raise Refused("the object is gone")
            run = live.take(obj) if live.job(obj) is self.job else live.simulation(obj)
        except Exception as error:
            return refused(self, obj, error)
        live.refuse(obj, self.bl_label, "")
        self.report({"INFO"}, summary(run))
        return {"FINISHED"}


def begin_modal(operator, context, tick):
    """Lets an operator hear of the timer and of Esc."""
    operator.timer = context.window_manager.event_timer_add(tick, window=context.window)
    context.window_manager.progress_begin(0, 1)
    context.window_manager.modal_handler_add(operator)


def show_progress(context, fraction, text):
    """At the pointer, and in the line at the bottom of the window."""
    context.window_manager.progress_update(fraction)
    context.workspace.status_text_set(f"{text}   Esc: stop")


def end_modal(operator, context):
    context.window_manager.event_timer_remove(operator.timer)
    context.window_manager.progress_end()
    context.workspace.status_text_set(None)


class SHELLWARP_OT_cancel(ShellOperator, bpy.types.Operator):
    """Stop the precompute that a frame began"""

    bl_idname = "shellwarp.cancel"
    bl_label = "Cancel"
    bl_options = {"REGISTER"}

    def run(self, _context, obj):
        if live.job(obj) is None:
            raise Refused("no precompute is under way")
        live.job(obj).cancel()


def summary(run):
    info, hertz = run.model.info(), run.model.frequencies()
    return (f"{info['modes']} modes, {hertz[0]:.3g} to {hertz[-1]:.3g} Hz, {info['n_fixed']} of {info['n_vertices']} "
            f"vertices held, {sum(info['seconds']):.1f} s, {megabytes(run)}")


def megabytes(run):
    """What memory a shell takes."""
    now, most = (size / 1e6 for size in run.memory())
    return f"{now:.3g} MB, {most:.3g} MB while precomputing"


class SHELLWARP_OT_certify(ShellOperator, bpy.types.Operator):
    """Estimate how far the present frame is from the full nonlinear shell; takes seconds on large meshes. Esc stops it"""

    bl_idname = "shellwarp.certify"
    bl_label = "Certify"
    bl_options = {"REGISTER"}

    def run(self, _context, obj):
        run = live.simulation(obj)
        if run is None:
            raise Refused("go to the start frame and play from there")
        self.report({"INFO"}, run.certify())

    def invoke(self, context, _event):
        """The estimate is made on a thread."""
        self.shell, self.name = live.simulation(context.object), context.object.name
        if self.shell is None:
            return self.execute(context)
        try:
            self.estimate = self.shell.estimate()
        except Exception as error:
            return refused(self, context.object, error)
        begin_modal(self, context, TICK)
        show_progress(context, 0.0, f"{self.name}: {self.estimate.text()}")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self.estimate.cancel()
            end_modal(self, context)
            self.report({"ERROR"}, "the estimate was stopped")
            return {"CANCELLED"}
        if self.estimate.running():
            show_progress(context, 0.0, f"{self.name}: {self.estimate.text()}")
            return {"RUNNING_MODAL"}
        end_modal(self, context)
        try:
            self.report({"INFO"}, self.shell.certify(self.estimate))
        except Exception as error:
            return refused(self, context.object, error)
        live.refuse(context.object, self.bl_label, "")
        return {"FINISHED"}


class SHELLWARP_OT_bake(ShellOperator, bpy.types.Operator):
    """Run all selected shells from start to end into point caches, which modifiers then play. Esc stops it"""

    bl_idname = "shellwarp.bake"
    bl_label = "Bake"

    def run(self, context, _obj):
        for _ in bake.bake(chosen(context), context):
            pass
        self.tell(chosen(context))

    def invoke(self, context, _event):
        self.chosen = chosen(context)
        self.frames = bake.bake(self.chosen, context)
        begin_modal(self, context, 0.0)
        return {"RUNNING_MODAL"}

    def tell(self, objects):
        for obj in objects:
            self.report({"INFO"}, baked(obj))

    def modal(self, context, event):
        if event.type == "ESC":
            self.frames.close()
            return self.end(context, {"CANCELLED"})
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            show_progress(context, *next(self.frames))
        except StopIteration:
            live.refuse(context.object, self.bl_label, "")
            self.tell(self.chosen)
            return self.end(context, {"FINISHED"})
        except Exception as error:
            return self.end(context, refused(self, context.object, error))
        return {"RUNNING_MODAL"}

    def end(self, context, result):
        end_modal(self, context)
        return result


def chosen(context):
    """The active shell and the other selected ones."""
    others = [item for item in context.selected_objects if item != context.object and item.type == "MESH" and item.shellwarp.enabled]
    return [context.object, *others]


def baked(obj):
    """Where a bake went, and how good it is."""
    return f"“{obj.name}” baked to {bake.baked(obj).filepath}; {obj.shellwarp.verdict}"


class SHELLWARP_OT_free_bake(ShellOperator, bpy.types.Operator):
    """Take the caches' modifiers of all selected shells away and go live again; the files stay"""

    bl_idname = "shellwarp.free_bake"
    bl_label = "Free bake"

    def run(self, context, _obj):
        for item in chosen(context):
            bake.free(item)


class SHELLWARP_OT_add_handle(ShellOperator, bpy.types.Operator):
    """Add an empty that leads a vertex: the selected one, or the one nearest to the 3D cursor"""

    bl_idname = "shellwarp.add_handle"
    bl_label = "Add handle"

    vertex: bpy.props.IntProperty(name="Vertex", default=-1, min=-1, description="-1: the selected one, or the one nearest "
                                  "to the 3D cursor")

    def run(self, context, obj):
        matrix = evaluated(obj, context.evaluated_depsgraph_get())
        split_matrix(matrix)
        vertex = self.vertex if self.vertex >= 0 else choose_vertex(context, obj, matrix)
        if vertex >= len(obj.data.vertices):
            raise Refused(f"there is no vertex {vertex}")
        empty = bpy.data.objects.new(f"{obj.name} handle", None)
        empty.empty_display_type, empty.empty_display_size = "ARROWS", 0.15 * max(obj.dimensions)
        empty.rotation_mode = "QUATERNION"
        empty.location = matrix @ obj.data.vertices[vertex].co
        empty.rotation_quaternion = matrix.to_quaternion()
        context.collection.objects.link(empty)
        item = obj.shellwarp.handles.add()
        item.name, item.target, item.vertex = empty.name, empty, vertex
        obj.shellwarp.active_handle = len(obj.shellwarp.handles) - 1


def choose_vertex(context, obj, matrix):
    """The one selected vertex; with none or several, the one nearest to the 3D cursor."""
    selected = [v.index for v in obj.data.vertices if v.select]
    if len(selected) == 1:
        return selected[0]
    cursor = matrix.inverted() @ context.scene.cursor.location
    return int(((rest_positions(obj.data) - cursor) ** 2).sum(axis=1).argmin())


class SHELLWARP_OT_remove_handle(ShellOperator, bpy.types.Operator):
    """Let the chosen handle's vertex go; its empty stays"""

    bl_idname = "shellwarp.remove_handle"
    bl_label = "Remove handle"

    def run(self, _context, obj):
        settings = obj.shellwarp
        settings.handles.remove(settings.active_handle)
        settings.active_handle = max(0, min(settings.active_handle, len(settings.handles) - 1))


class SHELLWARP_OT_add_render(ShellOperator, bpy.types.Operator):
    """Let the other selected meshes follow the shell, which is then a proxy for them; with none selected, add an empty line"""

    bl_idname = "shellwarp.add_render"
    bl_label = "Add render mesh"

    def run(self, context, obj):
        settings = obj.shellwarp
        there = [item.target for item in settings.renders]
        chosen = [item for item in context.selected_objects if item.type == "MESH" and item != obj and item not in there]
        for item in chosen or [None]:
            settings.renders.add().target = item
        settings.active_render = len(settings.renders) - 1


class SHELLWARP_OT_remove_render(ShellOperator, bpy.types.Operator):
    """Let the chosen mesh follow no more: it is at rest again"""

    bl_idname = "shellwarp.remove_render"
    bl_label = "Remove render mesh"

    def run(self, _context, obj):
        settings = obj.shellwarp
        if settings.active_render >= len(settings.renders):
            raise Refused("there is no render mesh")
        item = settings.renders[settings.active_render].target
        if item is not None:
            bake.remove(item)
            render_mesh.release(item)
        settings.renders.remove(settings.active_render)
        settings.active_render = max(0, min(settings.active_render, len(settings.renders) - 1))


class SHELLWARP_OT_export(ShellOperator, bpy.types.Operator, ExportHelper):
    """Export the selected objects, baked shells as moving meshes, over the shell's frames. Of a proxy its render meshes go out"""

    bl_idname = "shellwarp.export"
    bl_label = "Export Alembic or USD"
    bl_options = {"REGISTER"}

    filename_ext = ".abc"
    check_extension = None  # .abc, .usd, .usda, .usdc or .usdz as the user types
    filter_glob: bpy.props.StringProperty(default="*.abc;*.usd;*.usda;*.usdc;*.usdz", options={"HIDDEN"})

    def run(self, context, obj):
        export(context, obj, bpy.path.abspath(self.filepath))
        self.report({"INFO"}, f"exported to {self.filepath}")


def export(context, obj, path):
    """Writes a file of the selected objects; every shell among them must be baked. Proxies are left out for what follows them."""
    chosen = context.selected_objects
    for item in chosen:
        for moved in moving(item):
            if bake.baked(moved) is None:
                raise Refused(f"bake “{item.name}” first: exporters take a mesh that only a handler moves for still")
        if item.type == "MESH" and item.shellwarp.enabled and bake.stale(item):
            raise Refused(f"“{item.name}”: {bake.stale(item)}")
    drawn = [moved for item in chosen for moved in moving(item) or [item]]
    with selected(context, chosen, drawn):
        write(context, obj, path)


def moving(item):
    """What is drawn of a shell: the meshes that follow it, else itself; nothing of another object."""
    if item.type != "MESH" or not item.shellwarp.enabled:
        return []
    return render_mesh.objects(item) or [item]


@contextmanager
def selected(context, before, wanted):
    """Selects objects for the exporters, which go by the selection."""
    present = set(context.view_layer.objects)
    missing = next((item.name for item in wanted if item not in present or item.hide_select or not item.visible_get()), None)
    if missing:
        raise Refused(f"“{missing}” is hidden, cannot be selected, or is not in the view layer: exporters go by the selection")
    for item in before:
        item.select_set(False)
    for item in wanted:
        item.select_set(True)
    try:
        yield
    finally:
        for item in wanted:
            item.select_set(False)
        for item in before:
            item.select_set(True)


def write(context, obj, path):
    """Writes the selected objects over the frames of a shell."""
    settings, scene = obj.shellwarp, context.scene
    if path.lower().endswith(".abc"):
        bpy.ops.wm.alembic_export(filepath=path, start=settings.frame_start, end=settings.frame_end, selected=True,
                                  as_background_job=False, evaluation_mode="RENDER")
        return
    if not path.lower().endswith((".usd", ".usda", ".usdc", ".usdz")):
        raise Refused("the file's name must end in .abc, .usd, .usda, .usdc or .usdz")
    before = scene.frame_start, scene.frame_end
    scene.frame_start, scene.frame_end = settings.frame_start, settings.frame_end
    try:  # shape keys would be written as blend shapes, and modifiers with them left out
        bpy.ops.wm.usd_export(filepath=path, selected_objects_only=True, export_animation=True, export_shapekeys=False,
                              evaluation_mode="RENDER")
    finally:
        scene.frame_start, scene.frame_end = before


_CLASSES = (SHELLWARP_OT_precompute, SHELLWARP_OT_cancel, SHELLWARP_OT_certify, SHELLWARP_OT_bake, SHELLWARP_OT_free_bake, SHELLWARP_OT_add_handle,
            SHELLWARP_OT_remove_handle, SHELLWARP_OT_add_render, SHELLWARP_OT_remove_render, SHELLWARP_OT_export)


def register():
    for item in _CLASSES:
        bpy.utils.register_class(item)


def unregister():
    for item in reversed(_CLASSES):
        bpy.utils.unregister_class(item)
