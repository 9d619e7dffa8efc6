import "./theme.css";
import "./page.css";
import "./pictures.css";
import "./panels.css";
import { Explorer } from "./explorer";

new Explorer();
