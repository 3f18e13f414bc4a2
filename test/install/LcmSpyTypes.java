import java.lang.reflect.Field;
import java.util.Map;

/** Prints the message types that lcm-spy finds on the class path, one a line. */
public class LcmSpyTypes {
  public static void main(String[] arguments) throws Exception {
    lcm.spy.LCMTypeDatabase database = new lcm.spy.LCMTypeDatabase();
    Field classes = lcm.spy.LCMTypeDatabase.class.getDeclaredField("classes");
    classes.setAccessible(true);
    for (Object type : ((Map<?, ?>) classes.get(database)).values()) {
      System.out.println(((Class<?>) type).getName());
    }
  }
}
