"""The menu of shellWarp, its shelf and its line in the viewport; each does what the command shellWarp does."""

from maya import cmds, mel

MENU = "shellWarpMenu"
DISPLAY = "shellWarpStatus"

# Label, what runs, what a person reads in the help line.
ACTIONS = (
    ("Create", "shellWarp", "Selected meshes become shells; selected vertices are held"),
    ("Handles on Vertices", "shellWarp -handle", "A locator leads each selected vertex of a shell"),
    ("Touch Meshes", "shellWarp -collider", "The shell, selected last, touches the meshes selected before it"),
    ("Tie Two Vertices", "shellWarp -tie", "Two selected vertices of a shell are held together, where they are beside each other"),
    ("Crease", "shellWarp -crease", "The selected edges of a shell fold more easily, or rest at an angle"),
    ("Contact Patches", "shellWarp -contactPatches", "The shell gives way on its own where small things touch the selected vertices"),
)


def create_menu():
    if cmds.about(batch=True):
        return
    delete_menu()
    window = mel.eval("$shellWarpWindow = $gMainWindow")
    cmds.menu(MENU, label="Shell Warp", parent=window, tearOff=True)
    for label, command, annotation in ACTIONS:
        cmds.menuItem(label=label, command=command, sourceType="mel", annotation=annotation, parent=MENU)
    for axes in ("x", "y", "z"):
        cmds.menuItem(label="Hold along %s" % axes, command="shellWarp -supportAxes " + axes, sourceType="mel", parent=MENU,
                      annotation="The selected vertices of a shell are held along this axis of its object alone")
    cmds.menuItem(label="Paint Supports", command="import shellwarp_maya; shellwarp_maya.paint()", sourceType="python", parent=MENU)
    cmds.menuItem(label="Certify", command="import shellwarp_maya; shellwarp_maya.certify()", sourceType="python", parent=MENU)
    cmds.menuItem(label="Write Frames", command="import shellwarp_maya; shellwarp_maya.write_frames()", sourceType="python", parent=MENU)
    cmds.menuItem(divider=True, parent=MENU)
    cmds.menuItem(label="Buttons on This Shelf", command="import shellwarp_maya; shellwarp_maya.add_to_shelf()", sourceType="python", parent=MENU)
    show_status()


def delete_menu():
    if cmds.about(batch=True):
        return
    if cmds.menu(MENU, exists=True):
        cmds.deleteUI(MENU)
    if cmds.headsUpDisplay(DISPLAY, exists=True):
        cmds.headsUpDisplay(DISPLAY, remove=True)


def add_to_shelf():
    """Buttons for the menu's actions on the shelf that is open."""
    shelves = mel.eval("$shellWarpShelves = $gShelfTopLevel")
    shelf = cmds.tabLayout(shelves, query=True, selectTab=True)
    for label, command, annotation in ACTIONS:
        cmds.shelfButton(label=label, command=command, sourceType="mel", annotation=annotation, image="shellWarp.png",
                         imageOverlayLabel=label.split()[0], parent=shelf)


def show_status():
    """What shells have to tell, in every viewport: an error, a shape that was not simulated."""
    section = 7
    cmds.headsUpDisplay(DISPLAY, section=section, block=cmds.headsUpDisplay(nextFreeBlock=section), blockSize="small",
                        label="", labelFontSize="large", dataFontSize="large", command=status, attachToRefresh=True)


def status():
    return cmds.shellWarp(status=True)


def certify():
    """Prints how far the present frame of each selected shell is off the full shell."""
    found = cmds.shellWarp(certify=True)   # a list, of one shell perhaps its text
    print(found if isinstance(found, str) else "\n".join(found))


def write_frames():
    """Asks for a file, writes the frames of the selected shells that were played, and certifies the last that was shown."""
    chosen = cmds.fileDialog2(caption="Frames of the selected shells", fileFilter="Frames of a shell (*.swframes)", fileMode=0)
    if chosen:
        cmds.shellWarp(writeCache=chosen[0])
        certify()


def paint(node=None, painted="supportWeights"):
    """Opens the Paint Attributes tool on a map of a shell, its supports unless said otherwise: of the node, or of what is selected."""
    if node is None:
        history = cmds.ls(cmds.listHistory(pruneDagObjects=True) or [], type="shellWarp")
        if not history:
            cmds.warning("shellWarp: select a shell to paint its supports")
            return
        node = history[0]
    mel.eval('artSetToolAndSelectAttr("artAttrCtx", "shellWarp.%s.%s")' % (node, painted))
