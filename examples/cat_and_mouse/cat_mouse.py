"""Cat and Mouse as a builder script of MORSE: the world of its tutorial."""

from morse.builder import ATRV, Environment, Keyboard, MotionVW, SemanticCamera

SIDES = {"cameraL": 0.3, "cameraR": -0.3}

# The mouse is driven by the keyboard. Its properties let semantic cameras see it, under its label.
mouse = ATRV()
mouse.translate(x=1.0, z=0.2)
mouse.properties(Object=True, Graspable=False, Label="MOUSE")
keyboard = Keyboard()
keyboard.properties(Speed=3.0)
mouse.append(keyboard)

# The cat is driven through sockets. Its two cameras look straight ahead, beside one another.
cat = ATRV()
cat.translate(x=-6.0, z=0.2)
motion = MotionVW()
motion.add_stream("socket")
cat.append(motion)
for name, y in SIDES.items():
    camera = SemanticCamera(name)
    camera.translate(x=0.2, y=y, z=0.9)
    camera.add_stream("socket")
    cat.append(camera)

env = Environment("land-1/trees")
